// Looks at a folder of tiles with 3d-tiles-renderer in a headless Chromium, and takes pictures.
//
//     node view.mjs FOLDER OUT_PREFIX open|closed DISTANCE:TARGET[:X,Y,Z] ...
//
// DISTANCE is in radii of the model, TARGET the error in pixels that the viewer aims at, X,Y,Z the way from
// the model's middle to the eye. Of a closed model magenta pixels are cracks. `CHROMIUM` names the browser. Fails where a tile cannot be loaded or
// nothing is drawn.
import fs from 'node:fs';
import http from 'node:http';
import path from 'node:path';
import { fileURLToPath } from 'node:url';
import esbuild from 'esbuild';
import { chromium } from 'playwright-core';

const [folder, prefix, kind, ...views] = process.argv.slice(2);
const here = path.dirname(fileURLToPath(import.meta.url));
const bundle = await esbuild.build({
  entryPoints: [path.join(here, 'page.js')],
  bundle: true, write: false, format: 'iife', logLevel: 'error', nodePaths: [path.resolve('node_modules')],
});
const script = bundle.outputFiles[0].contents;
const page = '<!doctype html><style>*{margin:0}</style><body><script src="page.js"></script>';
const server = http.createServer((request, answer) => {
  const { pathname } = new URL(request.url, 'http://localhost');
  if (pathname === '/') return answer.setHeader('content-type', 'text/html').end(page);
  if (pathname === '/page.js') return answer.end(script);
  const file = path.join(folder, path.normalize(pathname).replace(/^[/\\]tiles[/\\]/, ''));
  return fs.readFile(file, (error, bytes) => {
    answer.statusCode = error ? 404 : 200;
    answer.end(error ? '' : bytes);
  });
});
await new Promise((done) => server.listen(0, '127.0.0.1', done));
const browser = await chromium.launch({
  executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
  args: ['--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader',
    '--disable-background-networking', '--disable-component-update', '--disable-sync'],
});
let bad = false;
try {
  const tab = await browser.newPage({ viewport: { width: 800, height: 600 } });
  tab.on('pageerror', (error) => { bad = true; console.error(String(error)); });
  await tab.goto(`http://127.0.0.1:${server.address().port}/`);
  for (const [number, view] of views.entries()) {
    const [distance, target, way] = view.split(':');
    const told = await tab.evaluate((v) => window.show(v), {
      distance: Number(distance), target: Number(target), closed: kind === 'closed',
      way: (way ?? '0.6,-1,0.5').split(',').map(Number),
    });
    bad ||= told.failed.length > 0 || told.drawn < 1000 || told.triangles === 0;
    console.log(JSON.stringify({ view, ...told }));
    await tab.screenshot({ path: `${prefix}-${number}.png` });
  }
} finally {
  await browser.close();
  server.close();
}
process.exit(bad ? 1 : 0);
