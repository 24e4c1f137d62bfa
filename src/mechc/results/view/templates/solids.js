// Shapes of unit size, shared by all bodies; sizes are scales.
const UP = new THREE.Vector3(0, 1, 0);
const shapes = {
  rod: new THREE.CylinderBufferGeometry(1, 1, 1, 14, 1),
  ball: new THREE.SphereBufferGeometry(1, 24, 14),
  disc: new THREE.CylinderBufferGeometry(1, 1, 1, 40, 1),
  box: new THREE.BoxBufferGeometry(1, 1, 1),
  cone: new THREE.ConeBufferGeometry(1, 1, 18),
  stand: new THREE.CylinderBufferGeometry(0.35, 1, 1, 20)
};
["ball", "disc"].forEach(function (name) { shapes[name + "Turning"] = withSectors(shapes[name]); });
let reach = 0, unit = 1, placed, solidCount;
measure();

function measure() {
  placed = floats(motion.placed); solidCount = motion.solids.length;  // x, y, z and a quaternion
  reach = motion.solids.reduce(function (most, solid) { return Math.max(most, halfSize(solid)); }, 0);
  unit = typicalSize();
}
function place(point, at, out) {
  const width = 3 * pointCount;
  return out.set(
    cubic(tracks, width, 3 * point, at), cubic(tracks, width, 3 * point + 1, at),
    cubic(tracks, width, 3 * point + 2, at)
  );
}
function placeSolid(solid, at, position, turn) {
  const width = 7 * solidCount, column = 7 * solid;
  position.set(cubic(placed, width, column, at), cubic(placed, width, column + 1, at), cubic(placed, width, column + 2, at));
  const i = Math.floor(at), s = at - i, a = i * width + column + 3;
  const b = Math.min(motion.frames - 1, i + 1) * width + column + 3;
  turn.set(
    placed[a] + s * (placed[b] - placed[a]), placed[a + 1] + s * (placed[b + 1] - placed[a + 1]),
    placed[a + 2] + s * (placed[b + 2] - placed[a + 2]), placed[a + 3] + s * (placed[b + 3] - placed[a + 3])
  ).normalize();
}
function withSectors(shape) {
  // Alternate sectors of a body of revolution are darker, so that its spin is seen.
  const made = shape.toNonIndexed(), at = made.attributes.position, shades = new Float32Array(3 * at.count);
  for (let k = 0; k < at.count; k += 3) {
    const x = at.getX(k) + at.getX(k + 1) + at.getX(k + 2), z = at.getZ(k) + at.getZ(k + 1) + at.getZ(k + 2);
    const sector = Math.floor((Math.atan2(z, x) / Math.PI + 1) * 4 - 1e-9);
    shades.fill(sector % 2 ? 1 : 0.78, 3 * k, 3 * k + 9);
  }
  made.setAttribute("color", new THREE.BufferAttribute(shades, 3));
  return made;
}
function halfSize(solid) {
  const s = solid.sizes;
  if (solid.kind === "box") { return Math.hypot(s[0], s[1], s[2]) / 2; }
  if (solid.kind === "disc") { return Math.hypot(s[0], s[1] / 2); }
  if (solid.kind === "mesh") { return farthest(solid); }
  return s[0] || 0;
}
function farthest(solid) {
  let most = 0;
  solid.corners = floats(solid.triangles);
  for (let k = 0; k < solid.corners.length; k += 3) {
    most = Math.max(most, Math.hypot(solid.corners[k], solid.corners[k + 1], solid.corners[k + 2]));
  }
  return most;
}
function supportOf(solid, turn, direction) {
  // How far a solid reaches from its middle in a direction.
  const s = solid.sizes, d = supportOf.d.copy(direction).applyQuaternion(supportOf.back.copy(turn).invert());
  if (solid.kind === "box") { return (Math.abs(d.x) * s[0] + Math.abs(d.y) * s[1] + Math.abs(d.z) * s[2]) / 2; }
  if (solid.kind === "disc") { return s[0] * Math.sqrt(Math.max(0, 1 - d.y * d.y)) + Math.abs(d.y) * s[1] / 2; }
  if (solid.kind === "wheel") { return s[0] * Math.sqrt(Math.max(0, 1 - d.y * d.y)) + 0.03 * s[0] * Math.abs(d.y); }
  if (solid.kind === "mesh") {
    let most = 0;
    for (let k = 0; k < solid.corners.length; k += 3) {
      most = Math.max(most, d.x * solid.corners[k] + d.y * solid.corners[k + 1] + d.z * solid.corners[k + 2]);
    }
    return most;
  }
  return solid.kind === "mass" ? 2.4 * unit : s[0];
}
supportOf.d = new THREE.Vector3();
supportOf.back = new THREE.Quaternion();

function typicalSize() {
  // A sixtieth of the mechanism's size at one time, less where its links are short.
  let size = 0, f, k, a;
  for (f = 0; f < motion.frames; f += Math.max(1, Math.floor(motion.frames / 60))) {
    for (a = 0; a < 3; a += 1) {
      let low = Infinity, high = -Infinity;
      for (k = 0; k < pointCount; k += 1) {
        const x = tracks[(f * pointCount + k) * 3 + a];
        low = Math.min(low, x); high = Math.max(high, x);
      }
      if (high > low) { size = Math.max(size, high - low); }
    }
  }
  size = Math.max(size, 2 * reach);
  const lengths = linkLengths();
  const typical = lengths.length ? lengths[Math.floor(lengths.length / 2)] : size;
  return Math.max(1e-9, Math.min(0.017 * (size || 1), 0.12 * (typical || size || 1)));
}
function linkLengths() {
  const found = [];
  motion.links.forEach(function (link) {
    for (let i = 1; i < link.points.length; i += 1) {
      const a = 3 * link.points[i - 1], b = 3 * link.points[i];
      found.push(Math.hypot(tracks[a] - tracks[b], tracks[a + 1] - tracks[b + 1], tracks[a + 2] - tracks[b + 2]));
    }
  });
  return found.filter(function (x) { return x > 0; }).sort(function (a, b) { return a - b; });
}
function material(colour, more) {
  return new THREE.MeshPhongMaterial(Object.assign({ color: colour, shininess: 40, specular: 0x222222 }, more));
}
function stretch(mesh, from, to, radius) {
  // A shape along y between two points.
  const way = stretch.way.subVectors(to, from), length = way.length();
  mesh.visible = length > 0;
  if (!mesh.visible) { return; }
  mesh.position.copy(from).addScaledVector(way, 0.5);
  mesh.quaternion.setFromUnitVectors(UP, way.divideScalar(length));
  mesh.scale.set(radius, length, radius);
}
stretch.way = new THREE.Vector3();

const LONG = 9;
class Helix extends THREE.Curve {
  // A spring of radius 1 and length LONG along y, with straight ends.
  constructor(turns) { super(); this.turns = turns; }
  getPoint(t, target) {
    const out = target || new THREE.Vector3(), inner = Math.max(0, Math.min(1, (t - 0.08) / 0.84));
    const wide = Math.min(1, t / 0.08, (1 - t) / 0.08), angle = 2 * Math.PI * this.turns * inner;
    return out.set(wide * Math.cos(angle), LONG * (t - 0.5), wide * Math.sin(angle));
  }
}
function springShape() {
  if (!shapes.spring) {
    shapes.spring = new THREE.TubeBufferGeometry(new Helix(8), 200, 0.2, 6);
    shapes.spring.scale(1, 1 / LONG, 1);
  }
  return shapes.spring;
}
