// The mechanism: rods and joints of the links, pivots on the ground, solids.
const parts = [];  // what moves: {move(at)}
const picked = [];  // meshes that have a name
const painted = [];  // {mesh, index}: link colours
const steel = [], earth = [];

function addMesh(shape, name, index) {
  const mesh = new THREE.Mesh(shape, material(0x888888));
  mesh.matrixAutoUpdate = true;
  world.add(mesh);
  if (name) { mesh.userData.name = name; picked.push(mesh); }
  if (index !== undefined) { painted.push({ mesh: mesh, index: index }); }
  return mesh;
}
function addLinks() {
  motion.links.forEach(function (link, index) {
    for (let i = 1; i < link.points.length; i += 1) { addRod(link, index, link.points[i - 1], link.points[i]); }
    if (link.points.length === 1) { addBall(link.label, index, link.points[0], 2.4 * unit); }
  });
}
function addRod(link, index, a, b) {
  const mesh = addMesh(shapes.rod, link.label, index), from = new THREE.Vector3(), to = new THREE.Vector3();
  parts.push({ move: function (at) { stretch(mesh, place(a, at, from), place(b, at, to), unit); } });
}
function addBall(name, index, point, radius) {
  const mesh = addMesh(shapes.ball, name, index);
  mesh.scale.setScalar(radius);
  parts.push({ move: function (at) { place(point, at, mesh.position); } });
  return mesh;
}
function addJoints() {
  const joints = new Set(motion.ground), singles = new Set();
  motion.links.forEach(function (link) {
    (link.points.length > 1 ? link.points : []).forEach(function (p) { joints.add(p); });
    if (link.points.length === 1) { singles.add(link.points[0]); }
  });
  const bare = motion.links.length === 0;
  motion.points.forEach(function (name, point) {
    const marked = motion.traced.indexOf(point) >= 0;
    if (!(joints.has(point) || bare || marked) || singles.has(point)) { return; }
    steel.push(addJoint(name, point, joints.has(point)));
  });
}
function addJoint(name, point, isJoint) {
  if (!motion.flat || !isJoint) { return addBall(name, undefined, point, (isJoint ? 1.45 : 1.2) * unit); }
  const mesh = addMesh(shapes.disc, name);  // a pin across the plane
  mesh.quaternion.setFromUnitVectors(UP, new THREE.Vector3(0, 0, 1));
  mesh.scale.set(1.55 * unit, 3.2 * unit, 1.55 * unit);
  parts.push({ move: function (at) { place(point, at, mesh.position); } });
  return mesh;
}
function addGround() {
  motion.ground.forEach(function (point) {
    const stand = addMesh(shapes.stand, motion.points[point] + " (ground)");
    const slab = addMesh(shapes.box, motion.points[point] + " (ground)");
    const turn = world.quaternion.clone().invert(), down = new THREE.Vector3(0, -1, 0).applyQuaternion(turn);
    stand.quaternion.copy(turn); slab.quaternion.copy(turn);
    stand.scale.set(2.4 * unit, 4 * unit, motion.flat ? 1.2 * unit : 2.4 * unit);
    slab.scale.set(7 * unit, 0.8 * unit, motion.flat ? 3.2 * unit : 7 * unit);
    earth.push(stand, slab);
    parts.push({ move: function (at) {
      place(point, at, stand.position);
      slab.position.copy(stand.position).addScaledVector(down, 4.4 * unit);
      stand.position.addScaledVector(down, 2 * unit);
    } });
  });
}
function solidReach() { return 1.6 * unit; }
function moveBodies(at) {
  for (let i = 0; i < parts.length; i += 1) { parts[i].move(at); }
}
function paintBodies() {
  painted.forEach(function (item) { item.mesh.material.color.set(colourOf(item.index, motion.links.length)); });
  steel.forEach(function (mesh) { mesh.material.color.set(mixed(look.ink, look.paper, look.name === "dark" ? 0.12 : 0.3)); });
  earth.forEach(function (mesh) { mesh.material.color.set(mixed(look.quiet, look.paper, 0.35)); });
}
themeUsers.push(paintBodies);

// -- names on hover ---------------------------------------------------------------------------
const caster = new THREE.Raycaster(), pointer = new THREE.Vector2();
let pending = null;
canvas.addEventListener("pointermove", function (event) {
  const first = pending === null;
  pending = event.buttons ? null : event;
  if (event.buttons) { hideTip(); } else if (first) { requestAnimationFrame(nameUnder); }
});
canvas.addEventListener("pointerleave", function () { pending = null; hideTip(); });
function hideTip() { found("tip").hidden = true; }
function nameUnder() {
  if (!pending || !renderer) { pending = null; return; }
  const box = canvas.getBoundingClientRect(), x = pending.clientX - box.left, y = pending.clientY - box.top;
  pending = null;
  pointer.set(2 * x / box.width - 1, 1 - 2 * y / box.height);
  caster.setFromCamera(pointer, camera);
  const hit = caster.intersectObjects(picked.filter(function (mesh) { return mesh.visible; }))[0];
  if (!hit) { hideTip(); return; }
  const tip = found("tip");
  tip.textContent = hit.object.userData.name;
  tip.hidden = false;
  tip.style.left = Math.min(x + 14, box.width - tip.offsetWidth - 8) + "px";
  tip.style.top = Math.min(y + 14, box.height - tip.offsetHeight - 8) + "px";
}
