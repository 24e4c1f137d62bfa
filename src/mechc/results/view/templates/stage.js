// The renderer, lights, ground and grid.  World coordinates: x to the right, y up, z to the viewer.
const stage = found("stage"), canvas = found("canvas");
const scene = new THREE.Scene(), world = new THREE.Group();
let renderer = null, grid = null, wanted = false, cell = 1;
scene.add(world);
scene.add(new THREE.HemisphereLight(0xffffff, 0x99a0ad, 0.72));
const sun = new THREE.DirectionalLight(0xffffff, 0.5);
scene.add(sun);

function startStage() {
  try {
    renderer = new THREE.WebGLRenderer({ canvas: canvas, antialias: true, alpha: true });
  } catch (refused) {
    found("failure").hidden = false;
    found("failure").textContent = "This browser draws nothing in space (WebGL is off): the plots still work.";
    return false;
  }
  const right = new THREE.Vector3().fromArray(motion.right), up = new THREE.Vector3().fromArray(motion.up);
  const turn = new THREE.Matrix4().makeBasis(right, up, new THREE.Vector3().crossVectors(right, up));
  world.quaternion.setFromRotationMatrix(turn).invert();
  world.updateMatrixWorld(true);
  addGrid();
  return true;
}
function resize() {
  const box = stage.getBoundingClientRect();
  if (!renderer || !(box.width > 0 && box.height > 0)) { return; }
  renderer.setPixelRatio(Math.min(2, window.devicePixelRatio || 1));
  renderer.setSize(box.width, box.height, false);
  camera.aspect = box.width / box.height;
  camera.updateProjectionMatrix();
  redraw();
}
function redraw() {
  if (wanted || !renderer) { return; }
  wanted = true;
  requestAnimationFrame(function (now) {
    wanted = false;
    fly(now);
    render();
  });
}
function render() {
  if (!renderer) { return; }
  sun.position.copy(camera.position).add(spare.set(0.3, 0.9, 0.2).multiplyScalar(camera.position.distanceTo(orbit.target)));
  sun.target.position.copy(orbit.target);
  sun.target.updateMatrixWorld();
  renderer.render(scene, camera);
}

// -- grid -------------------------------------------------------------------------------------
function roundLength(wished) {
  const power = Math.pow(10, Math.floor(Math.log10(wished))), lead = wished / power;
  return power * (lead >= 5 ? 5 : lead >= 2 ? 2 : 1);
}
function addGrid() {
  // Under a motion in space; behind one in a plane.
  const box = new THREE.Box3(), p = new THREE.Vector3();
  for (let i = 0; i < tracks.length; i += 3) {
    box.expandByPoint(world.localToWorld(p.set(tracks[i], tracks[i + 1], tracks[i + 2])));
  }
  if (box.isEmpty()) { return; }
  const reach = solidReach(), size = Math.max(60 * unit, box.getSize(p).length());
  cell = roundLength(Math.max(Math.min(size / 9, 0.6 * bodySize()), size / 120));
  const axes = motion.flat ? [0, 1, 2] : [0, 2, 1], low = box.min.toArray(), high = box.max.toArray();
  const level = motion.flat ? low[2] - reach - 3 * unit : low[1] - groundGap(reach);
  const ends = axes.slice(0, 2).map(function (a) {
    return [Math.floor((low[a] - reach) / cell - 0.4) * cell, Math.ceil((high[a] + reach) / cell + 0.4) * cell];
  });
  const corners = [];
  function line(a, from, to, other, at) {
    [from, to].forEach(function (x) {
      const corner = [0, 0, 0];
      corner[axes[a]] = x; corner[axes[other]] = at; corner[axes[2]] = level;
      corners.push(corner[0], corner[1], corner[2]);
    });
  }
  for (let a = 0; a < 2; a += 1) {
    const count = Math.round((ends[1 - a][1] - ends[1 - a][0]) / cell);
    for (let k = 0; k <= count; k += 1) { line(a, ends[a][0], ends[a][1], 1 - a, ends[1 - a][0] + k * cell); }
  }
  const shape = new THREE.BufferGeometry();
  shape.setAttribute("position", new THREE.Float32BufferAttribute(corners, 3));
  grid = new THREE.LineSegments(shape, new THREE.LineBasicMaterial({ transparent: true, opacity: 0.85 }));
  scene.add(grid);
  found("scale").textContent = "grid: " + String(Number(cell.toPrecision(3))) + " m";
}
function groundGap(reach) {
  // Pivots stand on the grid where they are the lowest.
  return motion.ground.length ? Math.max(reach, 5.2 * unit) : reach + 0.5 * unit;
}
themeUsers.push(function () {
  if (grid) { grid.material.color.set(look.line); }
  redraw();
});
