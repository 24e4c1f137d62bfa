// The paths of traced points: the whole of what is past, thin, and the last second, broad.
const RIBBON = 72, FINE = 4;  // pieces of a ribbon, and of a frame
const trails = [];
let tracesShown = true;

function addTrails() {
  motion.traced.forEach(function (point) {
    const whole = new Float32Array(3 * (FINE * (motion.frames - 1) + 1));
    for (let k = 0; 3 * k < whole.length; k += 1) { place(point, k / FINE, here).toArray(whole, 3 * k); }
    const line = new THREE.BufferGeometry();
    line.setAttribute("position", new THREE.BufferAttribute(whole, 3));
    const thin = new THREE.Line(line, new THREE.LineBasicMaterial({ transparent: true, opacity: 0.55 }));
    const ribbon = new THREE.Mesh(ribbonShape(), new THREE.MeshBasicMaterial({
      transparent: true, vertexColors: true, side: THREE.DoubleSide, depthWrite: false
    }));
    thin.frustumCulled = ribbon.frustumCulled = false;
    world.add(thin, ribbon);
    trails.push({ point: point, thin: thin, ribbon: ribbon });
  });
}
function ribbonShape() {
  const shape = new THREE.BufferGeometry(), index = [];
  shape.setAttribute("position", new THREE.BufferAttribute(new Float32Array(6 * (RIBBON + 1)), 3));
  const alpha = new Float32Array(8 * (RIBBON + 1)).fill(1);
  for (let k = 0; k <= RIBBON; k += 1) { alpha[8 * k + 3] = alpha[8 * k + 7] = Math.pow(k / RIBBON, 1.5); }
  shape.setAttribute("color", new THREE.BufferAttribute(alpha, 4));
  for (let k = 0; k < RIBBON; k += 1) { index.push(2 * k, 2 * k + 1, 2 * k + 2, 2 * k + 1, 2 * k + 3, 2 * k + 2); }
  shape.setIndex(index);
  return shape;
}
const eye = new THREE.Vector3(), here = new THREE.Vector3(), ahead = new THREE.Vector3(), across = new THREE.Vector3();
function moveTrails(at, speed) {
  const recent = Math.max(8, 0.9 * Math.max(speed, 0.25) / (motion.step || 1));
  world.worldToLocal(eye.copy(camera.position));
  trails.forEach(function (trail) {
    trail.thin.geometry.setDrawRange(0, Math.max(0, Math.ceil(FINE * (at - 0.8 * recent))) + 1);
    const out = trail.ribbon.geometry.attributes.position;
    for (let k = 0; k <= RIBBON; k += 1) {
      const f = Math.max(0, at - recent * (1 - k / RIBBON)), width = 0.55 * unit * (0.3 + 0.7 * k / RIBBON);
      place(trail.point, f, here);
      place(trail.point, Math.min(at, f + recent / RIBBON), ahead);
      if (k === RIBBON) { place(trail.point, Math.max(0, f - recent / RIBBON), ahead); across.subVectors(here, ahead); }
      else { across.subVectors(ahead, here); }
      across.cross(ahead.subVectors(eye, here)).normalize().multiplyScalar(width);
      out.setXYZ(2 * k, here.x + across.x, here.y + across.y, here.z + across.z);
      out.setXYZ(2 * k + 1, here.x - across.x, here.y - across.y, here.z - across.z);
    }
    out.needsUpdate = true;
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
