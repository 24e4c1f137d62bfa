// Shapes of unit size, shared by all bodies; sizes are scales.
const UP = new THREE.Vector3(0, 1, 0);
const shapes = {
  rod: new THREE.CylinderBufferGeometry(1, 1, 1, 14, 1),
  ball: new THREE.SphereBufferGeometry(1, 18, 12),
  disc: new THREE.CylinderBufferGeometry(1, 1, 1, 40, 1),
  box: new THREE.BoxBufferGeometry(1, 1, 1),
  cone: new THREE.ConeBufferGeometry(1, 1, 18),
  stand: new THREE.CylinderBufferGeometry(0.35, 1, 1, 20)
};
const unit = typicalSize();

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
  const lengths = linkLengths();
  const typical = lengths.length ? lengths[Math.floor(lengths.length / 2)] : size;
  return Math.max(1e-9, Math.min(0.017 * (size || motion.extent || 1), 0.12 * (typical || size || 1)));
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

class Helix extends THREE.Curve {
  // A spring of unit length along y, with straight ends.
  constructor(turns) { super(); this.turns = turns; }
  getPoint(t, target) {
    const out = target || new THREE.Vector3(), inner = Math.max(0, Math.min(1, (t - 0.08) / 0.84));
    const wide = Math.min(1, t / 0.08, (1 - t) / 0.08), angle = 2 * Math.PI * this.turns * inner;
    return out.set(wide * Math.cos(angle), t - 0.5, wide * Math.sin(angle));
  }
}
function springShape() {
  if (!shapes.spring) { shapes.spring = new THREE.TubeBufferGeometry(new Helix(9), 180, 0.16, 6); }
  return shapes.spring;
}
