// Reaction forces in the joints, and the forces among the loads.
const arrows = [];
const HEAD = 2.6, USUAL = 28, MOST = 1e4;  // lengths in radii of a rod

function addArrows() {
  Object.keys(FORCES).forEach(addForces);
}
function addForces(kind) {
  forcesOf(kind).forEach(function (arrow) {
    const shaft = addMesh(shapes.rod, arrow.label), head = addMesh(shapes.cone, arrow.label);
    const made = { at: floats(arrow.at), force: floats(arrow.force), kind: kind, shaft: shaft, head: head };
    arrows.push(made);
    [shaft, head].forEach(function (mesh) {  // over what they act on, which would hide them
      mesh.material.depthTest = false;
      mesh.renderOrder = 1;
    });
    parts.push({ move: function (at) { moveArrow(made, arrow, at); } });
  });
}
const force = new THREE.Vector3(), foot = new THREE.Vector3(), tip = new THREE.Vector3();
function moveArrow(made, arrow, at) {
  [0, 1, 2].forEach(function (k) {
    foot.setComponent(k, cubic(made.at, 3, k, at));
    force.setComponent(k, cubic(made.force, 3, k, at));
  });
  const size = force.length(), length = Math.min(MOST * unit, metresPerNewton(made.kind, USUAL * unit) * size);
  const shown = forcesShown.has(made.kind) && length > 0.3 * unit, top = Math.min(HEAD * unit, 0.6 * length);
  made.shaft.visible = made.head.visible = shown;
  made.shaft.userData.name = made.head.userData.name = arrow.label + ": " + number(size, digitsFor(size)) + " N";
  if (!shown) { return; }
  force.divideScalar(size);
  tip.copy(foot).addScaledVector(force, length - top);
  stretch(made.shaft, foot, tip, 0.4 * unit);
  made.head.quaternion.setFromUnitVectors(UP, force);
  made.head.scale.set(top / HEAD * 1.1, top, top / HEAD * 1.1);
  made.head.position.copy(tip).addScaledVector(force, top / 2);
}
function showArrows(kind, on) {
  if (on) { forcesShown.add(kind); } else { forcesShown.delete(kind); }
  tellScale();
  show();
}
themeUsers.push(function () {
  arrows.forEach(function (made) {
    const colour = made.kind === "loads" ? look.ink : look.event;
    made.shaft.material.color.set(colour);
    made.head.material.color.set(colour);
  });
});
