// What is drawn of the mechanism; made anew where the page is in a widget, which sends other motions.
const firstOrigin = new THREE.Vector3().fromArray(motion.origin);
let latest = null;

function addMechanism() {
  addGrid();
  addLinks();
  addJoints();
  addGround();
  addStruts();
  addSolids();
  addArrows();
  addTrails();
}
function takeMotion(given) {
  takeData(Object.assign({}, given, { right: motion.right, up: motion.up }));  // the camera stays
  measure();
  fillPlots();
  tellNotes();
  addMarks();
  const old = renderer ? removeMechanism() : [];
  if (renderer) { placeWorld(); addMechanism(); }
  reapplied.forEach(function (apply) { apply(); });
  readTheme();
  seek(state.elapsed);
  render();
  old.forEach(dispose);  // after the new ones are drawn, which share their programs
}
function placeWorld() {
  // Tracks are relative to the middle of their motion; what is at rest stays where it is.
  world.position.fromArray(motion.origin).sub(firstOrigin).applyQuaternion(world.quaternion);
  world.updateMatrixWorld(true);
}
function removeMechanism() {
  const old = world.children.concat(grid ? [grid] : []);
  old.forEach(function (part) { part.parent.remove(part); });
  [parts, picked, painted, steel, earth, inferred, arrows, trails].forEach(function (list) { list.length = 0; });
  grid = null;
  return old;
}
function dispose(part) {
  part.traverse(function (child) {
    if (child.geometry && Object.values(shapes).indexOf(child.geometry) < 0) { child.geometry.dispose(); }
    if (child.material) { child.material.dispose(); }
  });
}
function listenToWidget() {
  window.addEventListener("message", function (event) {
    if (event.source !== window.parent || !event.data || !event.data.motion) { return; }
    const first = latest === null;
    latest = event.data.motion;
    if (first) { requestAnimationFrame(takeLatest); }  // motions that come faster are passed over
  });
}
function takeLatest() {
  const given = latest;
  latest = null;
  takeMotion(given);
}
