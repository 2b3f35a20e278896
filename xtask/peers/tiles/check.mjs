// Other people's programs look at a folder of tiles.
//
//     node check.mjs FOLDER
//
// Every content must pass gltf-validator without an error or a warning. 3d-tiles-tools walks the tileset as
// a viewer does, with what the subtrees tell of tiles: errors must not grow from a tile to those below it,
// boxes must hold those below and all that the tile shows, and each file must belong to a tile.
import fs from 'node:fs';
import path from 'node:path';
import validator from 'gltf-validator';
import tools from '3d-tiles-tools';

const folder = path.resolve(process.argv[2]);
const faults = [];
const counts = { tiles: 0, contents: 0, errors: 0, warnings: 0, infos: 0 };
const seen = new Set();

function bounds(bytes) {
  const length = bytes.readUInt32LE(12);
  const gltf = JSON.parse(bytes.toString('utf8', 20, 20 + length));
  const { min, max } = gltf.accessors[gltf.meshes[0].primitives[0].attributes.POSITION];
  // y up becomes z up.
  return [[min[0], -max[2], min[1]], [max[0], -min[2], max[1]]];
}

const inside = (b, [low, high], slack) =>
  [0, 1, 2].every((a) => low[a] >= b[a] - b[3 + 4 * a] - slack && high[a] <= b[a] + b[3 + 4 * a] + slack);

async function visit(tile) {
  if (tile.isImplicitTilesetRoot()) return true;
  counts.tiles += 1;
  const own = tile.asFinalTile();
  const box = own.boundingVolume.box;
  const slack = 1e-6 * Math.max(...box.map(Math.abs));
  if (!tile.getParent().isImplicitTilesetRoot()) {
    const parent = tile.getParent().asFinalTile();
    if (own.geometricError > parent.geometricError) faults.push(`${tile.path}: its error grows`);
    const corner = (way) => [0, 1, 2].map((a) => box[a] + way * box[3 + 4 * a]);
    if (!inside(parent.boundingVolume.box, [corner(-1), corner(1)], slack)) {
      faults.push(`${tile.path}: its box is not in that of its parent`);
    }
  }
  for (const content of tile.getFinalContents()) {
    counts.contents += 1;
    seen.add(content.uri);
    const bytes = fs.readFileSync(path.join(folder, content.uri));
    const { issues } = await validator.validateBytes(new Uint8Array(bytes), { maxIssues: 10 });
    counts.errors += issues.numErrors;
    counts.warnings += issues.numWarnings;
    counts.infos += issues.numInfos;
    if (issues.numErrors + issues.numWarnings > 0) {
      faults.push(`${content.uri}: ${JSON.stringify(issues.messages.slice(0, 2))}`);
    }
    if (!inside(box, bounds(bytes), slack)) {
      faults.push(`${content.uri}: it is not in its box`);
    }
    if (bytes.length % 8 !== 0) faults.push(`${content.uri}: its length is no multiple of 8`);
  }
  return true;
}

const tileset = JSON.parse(fs.readFileSync(path.join(folder, 'tileset.json')));
const resolver = tools.ResourceResolvers.createFileResourceResolver(folder);
const traverser = new tools.TilesetTraverser(folder, resolver, { depthFirst: false });
await traverser.traverseWithSchema(tileset, tileset.schema, visit);
for (const name of fs.readdirSync(path.join(folder, 'content'), { recursive: true })) {
  const uri = path.posix.join('content', name.split(path.sep).join('/'));
  if (uri.endsWith('.glb') && !seen.has(uri)) faults.push(`${uri}: it belongs to no tile`);
}
console.log(JSON.stringify(counts));
faults.slice(0, 20).forEach((fault) => console.error(fault));
process.exit(faults.length === 0 ? 0 : 1);
