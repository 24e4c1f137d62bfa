// Reaction forces in the joints, and the forces among the loads.
const arrows = [];
const HEAD = 2.6, USUAL = 28, MOST = 60;  // lengths in radii of a rod

function addArrows() {
  addForces(motion.arrows, "reaction", true);
  addForces(motion.loads, "load", false);
}
function addForces(given, kind, shown) {
  given.forEach(function (arrow) {
    const shaft = addMesh(shapes.rod, arrow.label), head = addMesh(shapes.cone, arrow.label);
    const made = { at: floats(arrow.at), force: floats(arrow.force), kind: kind, shaft: shaft, head: head, shown: shown };
    arrows.push(made);
    parts.push({ move: function (at) { moveArrow(made, arrow, at); } });
  });
}
const force = new THREE.Vector3(), foot = new THREE.Vector3(), tip = new THREE.Vector3();
function moveArrow(made, arrow, at) {
  [0, 1, 2].forEach(function (k) {
    foot.setComponent(k, cubic(made.at, 3, k, at));
    force.setComponent(k, cubic(made.force, 3, k, at));
  });
  const size = force.length(), length = Math.min(MOST, USUAL * size / (arrow.usual || 1)) * unit;
  const shown = made.shown && length > HEAD * unit;
  made.shaft.visible = made.head.visible = shown;
  made.shaft.userData.name = made.head.userData.name = arrow.label + ": " + number(size, digitsFor(size)) + " N";
  if (!shown) { return; }
  force.divideScalar(size);
  tip.copy(foot).addScaledVector(force, length - HEAD * unit);
  stretch(made.shaft, foot, tip, 0.4 * unit);
  made.head.quaternion.setFromUnitVectors(UP, force);
  made.head.scale.set(1.1 * unit, HEAD * unit, 1.1 * unit);
  made.head.position.copy(tip).addScaledVector(force, HEAD * unit / 2);
}
function showArrows(kind, on) {
  arrows.forEach(function (made) { if (made.kind === kind) { made.shown = on; } });
  show();
}
themeUsers.push(function () {
  arrows.forEach(function (made) {
    const colour = made.kind === "load" ? look.accent : look.event;
    made.shaft.material.color.set(colour);
    made.head.material.color.set(colour);
  });
});
