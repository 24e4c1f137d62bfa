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
const struts = new Set(motion.struts.filter(function (strut) { return strut.kind !== "muscle"; }).map(function (strut) {
  return pairOf(strut.points[0], strut.points[1]);
}));
const inferred = [];  // translucent bodies

function pairOf(a, b) { return Math.min(a, b) + " " + Math.max(a, b); }
function addLinks() {
  motion.links.forEach(function (link, index) {
    for (let i = 1; i < link.points.length; i += 1) { addRod(link, index, link.points[i - 1], link.points[i]); }
    if (link.points.length === 1 && !hasSolid(link.label) && !hasBlock(link.label)) { addBall(link.label, index, link.points[0], 2.4 * unit); }
  });
}
function addRod(link, index, a, b) {
  if (struts.has(pairOf(a, b))) { return; }
  const mesh = addMesh(shapes.rod, link.label, index), from = new THREE.Vector3(), to = new THREE.Vector3();
  parts.push({ move: function (at) { stretch(mesh, place(a, at, from), place(b, at, to), unit); } });
}
function hasSolid(label) { return motion.solids.some(function (solid) { return solid.name === label; }); }
function hasBlock(label) { return guides().some(function (guide) { return guide.block && guide.label === label; }); }
function guides() { return motion.guides || []; }
function addGuides() {
  // A rail, and a block on it where the body has no solid.
  const along = new THREE.Vector3(), from = new THREE.Vector3(), to = new THREE.Vector3();
  guides().forEach(function (guide, k) {
    const rail = addMesh(shapes.box, "guide of " + guide.label), ends = guide.points;
    const block = guide.block ? addMesh(shapes.box, guide.label, colourIndex({ name: guide.label }, k)) : null;
    earth.push(rail);
    if (block) { block.scale.set(4.4 * unit, 6.6 * unit, 4.4 * unit); }
    parts.push({ move: function (at) {
      stretch(rail, place(ends[0], at, from), place(ends[1], at, to), 1.1 * unit);
      if (!block) { return; }
      block.quaternion.setFromUnitVectors(UP, along.subVectors(to, from).normalize());
      place(ends[2], at, block.position);
    } });
  });
}
function addBall(name, index, point, radius) {
  const mesh = addMesh(shapes.ball, name, index);
  mesh.scale.setScalar(radius);
  parts.push({ move: function (at) { place(point, at, mesh.position); } });
  return mesh;
}
function addJoints() {
  const joints = new Set(motion.ground), singles = new Set();
  motion.struts.forEach(function (strut) { strut.points.forEach(function (p) { joints.add(p); }); });
  motion.links.forEach(function (link) {
    (link.points.length > 1 ? link.points : []).forEach(function (p) { joints.add(p); });
    if (link.points.length === 1) { singles.add(link.points[0]); }
  });
  const bare = motion.links.length === 0;
  motion.points.forEach(function (name, point) {
    const marked = motion.traced.indexOf(point) >= 0;
    if (!(joints.has(point) || bare || marked) || singles.has(point) || !isMarked(point)) { return; }
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

// -- springs, dampers, solids -----------------------------------------------------------------
function addStruts() {
  motion.struts.forEach(function (strut) {
    if (strut.kind === "muscle") { addMuscle(strut); return; }
    const from = new THREE.Vector3(), to = new THREE.Vector3(), middle = new THREE.Vector3();
    const isSpring = strut.kind === "spring";
    const mesh = addMesh(isSpring ? springShape() : shapes.rod, strut.label);
    const rod = isSpring ? null : addMesh(shapes.rod, strut.label);
    steel.push(mesh);
    if (rod) { earth.push(rod); }
    parts.push({ move: function (at) {
      place(strut.points[0], at, from); place(strut.points[1], at, to);
      if (isSpring) { stretch(mesh, from, to, 1.7 * unit); return; }
      middle.lerpVectors(from, to, 0.55);
      stretch(mesh, from, middle, 1.3 * unit);
      stretch(rod, from, to, 0.5 * unit);
    } });
  });
}
function addMuscle(muscle) {
  // Rods along its path, thicker where it is active, and balls where it bends.
  const places = muscle.points.map(function () { return new THREE.Vector3(); });
  const rods = places.slice(1).map(function () { return addMesh(shapes.rod, muscle.label); });
  const bends = places.slice(2).map(function () { return addMesh(shapes.ball, muscle.label); });
  parts.push({ move: function (at) {
    const active = activationOf(muscle, at), radius = (0.4 + 1.2 * active) * unit;
    muscle.points.forEach(function (point, k) { place(point, at, places[k]); });
    rods.forEach(function (rod, k) { stretch(rod, places[k], places[k + 1], radius); });
    bends.forEach(function (ball, k) { ball.position.copy(places[k + 1]); ball.scale.setScalar(radius); });
    rods.concat(bends).forEach(function (mesh) {
      if (look) { mesh.material.color.set(colourOfMuscle(active)); }
      mesh.userData.name = muscle.label + ": activation " + number(active, 2);
    });
  } });
}
function addSolids() {
  motion.solids.forEach(function (solid, k) {
    if (solid.inferred && solid.kind === "disc" && solid.sizes[0] < 2 * unit && motion.links.length) { return; }
    const index = colourIndex(solid, k), made = solidParts(solid, index), group = new THREE.Group();
    made.forEach(function (mesh) { group.add(mesh); });
    world.add(group);
    if (solid.inferred) {
      inferred.push(group);
      Object.assign(made[0].material, { transparent: true, opacity: 0.42, depthWrite: false });
    }
    parts.push({ move: function (at) { placeSolid(k, at, group.position, group.quaternion); } });
  });
}
function colourIndex(solid, k) {
  const same = motion.links.findIndex(function (link) { return link.label === solid.name; });
  return same >= 0 ? same : motion.links.length + k;
}
function solidParts(solid, index) {
  const s = solid.sizes, name = solid.label;
  const shape = { ball: "ballTurning", mass: "ball", disc: "discTurning", box: "box" }[solid.kind];
  if (solid.kind === "wheel") { return wheelParts(s[0], name, index); }
  if (solid.kind === "mesh") {
    const surface = new THREE.BufferGeometry();
    surface.setAttribute("position", new THREE.BufferAttribute(solid.corners, 3));
    surface.computeVertexNormals();
    const mesh = addMesh(surface, name, index);
    mesh.material.side = THREE.DoubleSide;
    return [mesh];
  }
  const mesh = addMesh(shapes[shape], name, index);
  mesh.material.vertexColors = shape.endsWith("Turning");
  if (solid.kind === "box") { mesh.scale.fromArray(s); }
  else if (solid.kind === "disc") { mesh.scale.set(s[0], Math.max(s[1], 0.04 * s[0]), s[0]); }
  else { mesh.scale.setScalar(solid.kind === "mass" ? 2.4 * unit : s[0]); }
  return solid.inferred && solid.kind === "disc" && s[1] < s[0] ? [mesh].concat(rimParts(s[0], name, index)) : [mesh];
}
function rimParts(radius, name, index) {
  // Of a translucent disc: a rim and a spoke, without which neither its tilt nor its spin is seen.
  const rim = addMesh(tyreShape(), name, index), spoke = addMesh(shapes.rod, name, index);
  rim.scale.setScalar(radius);
  spoke.quaternion.setFromUnitVectors(UP, new THREE.Vector3(1, 0, 0));
  spoke.position.set(radius / 2, 0, 0);
  spoke.scale.set(0.03 * radius, 0.95 * radius, 0.03 * radius);
  return [rim, spoke];
}
function tyreShape() {
  if (!shapes.tyre) {
    shapes.tyre = new THREE.TorusBufferGeometry(0.95, 0.05, 10, 56);
    shapes.tyre.rotateX(Math.PI / 2);
  }
  return shapes.tyre;
}
function wheelParts(radius, name, index) {
  const tyre = addMesh(tyreShape(), name), hub = addMesh(shapes.disc, name, index), found = [tyre, hub];
  tyre.scale.setScalar(radius);
  hub.scale.set(0.09 * radius, 0.2 * radius, 0.09 * radius);
  steel.push(tyre);
  for (let k = 0; k < 6; k += 1) {
    const spoke = addMesh(shapes.rod, name, index), angle = Math.PI * k / 6;
    spoke.quaternion.setFromUnitVectors(UP, new THREE.Vector3(Math.cos(angle), 0, Math.sin(angle)));
    spoke.scale.set(0.012 * radius, 1.88 * radius, 0.012 * radius);
    found.push(spoke);
  }
  return found;
}
function showInferred(on) {
  inferred.forEach(function (group) { group.traverse(function (part) { part.visible = on; }); });
  redraw();
}
function moveBodies(at) {
  for (let i = 0; i < parts.length; i += 1) { parts[i].move(at); }
}
function paintBodies() {
  const colourCount = motion.links.length + motion.solids.length;
  painted.forEach(function (item) { item.mesh.material.color.set(colourOf(item.index, colourCount)); });
  steel.forEach(function (mesh) { mesh.material.color.set(mixColours(look.ink, look.paper, look.name === "dark" ? 0.12 : 0.4)); });
  earth.forEach(function (mesh) { mesh.material.color.set(mixColours(look.quiet, look.paper, 0.35)); });
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
function hideTip() { byId("tip").hidden = true; }
function nameUnder() {
  if (!pending || !renderer) { pending = null; return; }
  const box = canvas.getBoundingClientRect(), x = pending.clientX - box.left, y = pending.clientY - box.top;
  pending = null;
  pointer.set(2 * x / box.width - 1, 1 - 2 * y / box.height);
  caster.setFromCamera(pointer, camera);
  const hit = caster.intersectObjects(picked.filter(function (mesh) { return mesh.visible; }))[0];
  if (!hit) { hideTip(); return; }
  const tip = byId("tip");
  tip.textContent = hit.object.userData.name;
  tip.hidden = false;
  tip.style.left = Math.min(x + 14, box.width - tip.offsetWidth - 8) + "px";
  tip.style.top = canvas.offsetTop + Math.min(y + 14, box.height - tip.offsetHeight - 8) + "px";
}
