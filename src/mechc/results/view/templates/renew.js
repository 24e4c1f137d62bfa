// The picture in space as the player asks for it: started, painted, made anew for another motion.
let firstOrigin = null, latest = null;

function startPicture() {
  if (!startStage()) { return; }
  firstOrigin = new THREE.Vector3().fromArray(motion.origin);
  addMechanism();
  startCamera(canvas);
  addViews();
  addShows();
  canvas.tabIndex = 0;
  canvas.classList.add("turns");
  canvas.setAttribute("aria-label", motion.title + ", " + motion.links.length
    + " links in space; arrow keys turn the view, plus and minus come nearer");
  readTheme();
  if (motion.export) {
    exportPictures(motion.export);
    throw new Error("The pictures are drawn.");  // nothing else of the page is needed
  }
  resize();
  seeView(homeView, 0, true);
  if (motion.live) { listenToWidget(); }
}
function paint(at) {
  moveBodies(at);
  if (orbit) { followTo(at); moveTrails(at, state.speed); }
  redraw();
}
function addMechanism() {
  addGrid();
  addLinks();
  addGuides();
  addJoints();
  addGround();
  addStruts();
  addSolids();
  addArrows();
  addTrails();
}
function renewPicture() {
  if (renderer) { removeMechanism(); }
  measure();
  if (renderer) { placeWorld(); addMechanism(); }
  reapplied.forEach(function (apply) { apply(); });
}
function placeWorld() {
  // Tracks are relative to the middle of their motion; what is at rest stays where it is.
  world.position.fromArray(motion.origin).sub(firstOrigin).applyQuaternion(world.quaternion);
  world.updateMatrixWorld(true);
}
function removeMechanism() {
  const old = world.children.concat(grid ? [grid] : []);
  old.forEach(function (part) { part.parent.remove(part); });
  discarded.push.apply(discarded, old);
  [parts, picked, painted, steel, earth, inferred, arrows, trails].forEach(function (list) { list.length = 0; });
  grid = null;
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
  takeMotion(Object.assign({}, given, { right: motion.right, up: motion.up }));  // the camera stays
}
