// The page that shows tiles: `show` looks at them from a distance until all is loaded, and tells how much
// was drawn. Of closed models back faces are magenta, so that a crack shows.
import * as THREE from 'three';
import { TilesRenderer } from '3d-tiles-renderer/three';
import { ImplicitTilingPlugin } from '3d-tiles-renderer/core/plugins';

const renderer = new THREE.WebGLRenderer({ antialias: false, preserveDrawingBuffer: true });
document.body.appendChild(renderer.domElement);
renderer.setSize(innerWidth, innerHeight);
const scene = new THREE.Scene();
scene.background = new THREE.Color(0xf4f6f8);
const camera = new THREE.PerspectiveCamera(40, innerWidth / innerHeight, 0.01, 100);
camera.up.set(0, 0, 1);
const lamp = new THREE.DirectionalLight(0xffffff, 2.5);
scene.add(lamp, new THREE.AmbientLight(0xffffff, 0.9));

const tiles = new TilesRenderer('tiles/tileset.json');
tiles.registerPlugin(new ImplicitTilingPlugin());
tiles.setCamera(camera);
tiles.setResolutionFromRenderer(camera, renderer);
const whole = new THREE.Group();
whole.add(tiles.group);
scene.add(whole);
const failed = [];
tiles.addEventListener('load-error', (e) => failed.push(String(e.url)));
const fronts = [];
const back = new THREE.MeshBasicMaterial({ color: 0xff00ff, side: THREE.BackSide });

tiles.addEventListener('load-model', ({ scene: model }) => {
  model.traverse((o) => {
    if (!o.isMesh || o.userData.back) return;
    fronts.push(o.material);
    const inner = new THREE.Mesh(o.geometry, back);
    inner.userData.back = true;
    queueMicrotask(() => o.add(inner));
  });
});

const frame = () => new Promise((done) => requestAnimationFrame(done));

window.show = async ({ way, distance, target, closed }) => {
  const sphere = new THREE.Sphere();
  tiles.errorTarget = target;
  let still = 0;
  for (let i = 0; i < 3000 && still < 12; i += 1) {
    if (tiles.getBoundingSphere(sphere)) {
      const eye = new THREE.Vector3(...way).normalize().multiplyScalar(distance * sphere.radius);
      camera.position.copy(sphere.center).add(eye);
      camera.near = sphere.radius / 200;
      camera.far = sphere.radius * (distance + 2);
      camera.updateProjectionMatrix();
      camera.lookAt(sphere.center);
      camera.updateMatrixWorld();
      lamp.position.copy(camera.position);
      lamp.target.position.copy(sphere.center);
      lamp.target.updateMatrixWorld();
    }
    back.visible = closed;
    fronts.forEach((m) => { m.side = closed ? THREE.FrontSide : THREE.DoubleSide; });
    tiles.update();
    renderer.render(scene, camera);
    await frame();
    const { downloading, parsing, queued } = tiles.stats;
    still = tiles.root && downloading + parsing + (queued ?? 0) === 0 ? still + 1 : 0;
  }
  const levels = {};
  let triangles = 0;
  tiles.visibleTiles.forEach((tile) => {
    const level = tile.implicitTilingData?.level ?? tile.internal?.depth ?? 0;
    levels[level] = (levels[level] ?? 0) + 1;
    tile.engineData?.scene?.traverse((o) => {
      if (o.isMesh && !o.userData.back) triangles += o.geometry.index.count / 3;
    });
  });
  renderer.render(scene, camera);
  const gl = renderer.getContext();
  const [w, h] = [gl.drawingBufferWidth, gl.drawingBufferHeight];
  const pixels = new Uint8Array(4 * w * h);
  gl.readPixels(0, 0, w, h, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  let magenta = 0;
  let drawn = 0;
  for (let i = 0; i < pixels.length; i += 4) {
    const [r, g, b] = [pixels[i], pixels[i + 1], pixels[i + 2]];
    magenta += r > 250 && g < 5 && b > 250 ? 1 : 0;
    drawn += r === 0xf4 && g === 0xf6 && b === 0xf8 ? 0 : 1;
  }
  return { levels, triangles, magenta, drawn, failed };
};
