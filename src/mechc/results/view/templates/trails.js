// The paths of traced points: the whole of what is past, thin, and the last second, broad.
const RIBBON = 72, LONGEST_RIBBON = 1200;  // pieces of a ribbon: as many as its path has, these at least
const trails = [];
let tracesShown = true;

function addTrails() {
  motion.traced.forEach(function (_, order) {
    const whole = new Float32Array(3 * pathTimes.length), width = 3 * motion.traced.length;
    for (let i = 0; i < pathTimes.length; i += 1) {
      whole.set(paths.subarray(i * width + 3 * order, i * width + 3 * order + 3), 3 * i);
    }
    const line = new THREE.BufferGeometry();
    line.setAttribute("position", new THREE.BufferAttribute(whole, 3));
    const thin = new THREE.Line(line, new THREE.LineBasicMaterial({ transparent: true, opacity: 0.55 }));
    const ribbon = new THREE.Mesh(ribbonShape(), new THREE.MeshBasicMaterial({
      transparent: true, vertexColors: true, side: THREE.DoubleSide, depthWrite: false
    }));
    thin.frustumCulled = ribbon.frustumCulled = false;
    world.add(thin, ribbon);
    trails.push({ order: order, thin: thin, ribbon: ribbon });
  });
}
function ribbonShape() {
  const shape = new THREE.BufferGeometry(), index = [];
  shape.setAttribute("position", new THREE.BufferAttribute(new Float32Array(6 * (LONGEST_RIBBON + 1)), 3));
  shape.setAttribute("color", new THREE.BufferAttribute(new Float32Array(8 * (LONGEST_RIBBON + 1)).fill(1), 4));
  for (let k = 0; k < LONGEST_RIBBON; k += 1) { index.push(2 * k, 2 * k + 1, 2 * k + 2, 2 * k + 1, 2 * k + 3, 2 * k + 2); }
  shape.setIndex(index);
  return shape;
}
function ribbonTimes(now, recent) {
  // Those of the path, and between them so many that the ribbon fades evenly.
  const first = Math.max(0, now - recent), times = [first];
  for (let i = firstAfter(pathTimes, first); i < pathTimes.length && pathTimes[i] < now; i += 1) { fill(pathTimes[i]); }
  fill(now);
  return times.slice(-LONGEST_RIBBON - 1);
  function fill(to) {
    const from = times[times.length - 1], pieces = Math.max(1, Math.ceil((to - from) * RIBBON / recent));
    for (let k = 1; k <= pieces; k += 1) { times.push(from + (to - from) * k / pieces); }
  }
}
const eye = new THREE.Vector3(), here = new THREE.Vector3(), across = new THREE.Vector3(), toEye = new THREE.Vector3();
function moveTrails(at, speed) {
  const now = at * motion.step, recent = Math.max(8 * motion.step, 0.9 * Math.max(speed, 0.25));
  const times = ribbonTimes(now, recent), count = times.length, points = new Float32Array(3 * count), spot = [0, 0, 0];
  world.worldToLocal(eye.copy(camera.position));
  trails.forEach(function (trail) {
    const out = trail.ribbon.geometry.attributes.position, alpha = trail.ribbon.geometry.attributes.color;
    trail.thin.geometry.setDrawRange(0, firstAfter(pathTimes, now - 0.8 * recent));
    times.forEach(function (time, k) { points.set(pathAt(paths, 3, trail.order, time, spot), 3 * k); });
    for (let k = 0; k < count; k += 1) {
      const a = 3 * Math.max(0, k - 1), b = 3 * Math.min(count - 1, k + 1), part = Math.max(0, 1 - (now - times[k]) / recent);
      here.fromArray(points, 3 * k);
      across.set(points[b] - points[a], points[b + 1] - points[a + 1], points[b + 2] - points[a + 2]);
      across.cross(toEye.subVectors(eye, here)).normalize().multiplyScalar(0.55 * unit * (0.3 + 0.7 * part));
      out.setXYZ(2 * k, here.x + across.x, here.y + across.y, here.z + across.z);
      out.setXYZ(2 * k + 1, here.x - across.x, here.y - across.y, here.z - across.z);
      alpha.setW(2 * k, Math.pow(part, 1.5)); alpha.setW(2 * k + 1, Math.pow(part, 1.5));
    }
    trail.ribbon.geometry.setDrawRange(0, 6 * (count - 1));
    out.needsUpdate = alpha.needsUpdate = true;
  });
}
function showTraces(on) {
  tracesShown = on;
  trails.forEach(function (trail) { trail.thin.visible = trail.ribbon.visible = on; });
  redraw();
}
themeUsers.push(function () {
  trails.forEach(function (trail, i) {
    trail.thin.material.color.set(look.palette[i % look.palette.length]);
    trail.ribbon.material.color.set(look.palette[i % look.palette.length]);
  });
});
