// Shows the archives of a web map in MapLibre GL JS, as a web site would, in a headless Chromium:
//   node tests/maplibre.js FOLDER-OF-NODE_MODULES BAKE [FOLDER-FOR-SCREENSHOTS]
// The first must hold puppeteer-core, maplibre-gl and pmtiles; CHROMIUM names the browser, or it is the one in /usr/bin. The bake
// must have the export web, and GeoJSON in degrees, near the world's origin. WebGL is SwiftShader's, so no GPU is needed.
// Prints one line a check, with a figure; exits with 1 if one has failed.
const fs = require("fs");
const http = require("http");
const path = require("path");
const { createRequire } = require("module");
const { check, pixelsOf, run, wait } = require("./browser.js");

const [modules, bake, pictures] = process.argv.slice(2);
const puppeteer = createRequire(path.resolve(modules, "node_modules", "x"))("puppeteer-core");
const SIZE = { width: 900, height: 700, deviceScaleFactor: 1 };
const CLIENT = {
  "/maplibre-gl.js": "maplibre-gl/dist/maplibre-gl.js",
  "/maplibre-gl.css": "maplibre-gl/dist/maplibre-gl.css",
  "/pmtiles.js": "pmtiles/dist/pmtiles.js",
};
const TYPES = { ".js": "text/javascript", ".css": "text/css", ".geojson": "application/geo+json", ".html": "text/html" };
const PAGE = `<!doctype html><link rel="icon" href="data:,"><link rel="stylesheet" href="/maplibre-gl.css">
<style>body { margin: 0 } #view { width: 100vw; height: 100vh }</style><div id="view"></div>
<script src="/maplibre-gl.js"></script><script src="/pmtiles.js"></script>`;

const median = (numbers) => [...numbers].sort((a, b) => a - b)[Math.floor(numbers.length / 2)];

// Serves the page, the client and the bake, of which a client may ask for a range of bytes.
async function served() {
  const server = http.createServer((request, response) => {
    const asked = decodeURIComponent(new URL(request.url, "http://x").pathname);
    if (asked === "/") return response.writeHead(200, { "Content-Type": "text/html" }).end(PAGE);
    const file = CLIENT[asked] ? path.join(modules, "node_modules", CLIENT[asked]) : path.join(bake, asked.replace(/^\/bake\//, ""));
    if (!(CLIENT[asked] || asked.startsWith("/bake/")) || !fs.existsSync(file)) return response.writeHead(404).end();
    const bytes = fs.readFileSync(file);
    const type = { "Content-Type": TYPES[path.extname(file)] ?? "application/octet-stream" };
    const range = /^bytes=(\d+)-(\d+)$/.exec(request.headers.range ?? "");
    if (!range) return response.writeHead(200, type).end(bytes);
    const [first, last] = [Number(range[1]), Math.min(Number(range[2]), bytes.length - 1)];
    response.writeHead(206, { ...type, "Content-Range": `bytes ${first}-${last}/${bytes.length}` }).end(bytes.subarray(first, last + 1));
  });
  await new Promise((listens) => server.listen(0, "127.0.0.1", listens));
  return server;
}

// Shows some layers, and waits until all is drawn.
function shown(page, bounds, layers, view = {}) {
  return page.evaluate(
    async (bounds, layers, view) => {
      if (!window.map) {
        maplibregl.addProtocol("pmtiles", new pmtiles.Protocol().tile);
        const archive = (name) => `pmtiles://${location.origin}/bake/web/${name}.pmtiles`;
        const dem = { type: "raster-dem", url: archive("terrain"), encoding: "mapbox", tileSize: 256 };
        window.map = new maplibregl.Map({
          container: "view",
          bounds,
          fadeDuration: 0,
          canvasContextAttributes: { preserveDrawingBuffer: true },
          style: {
            version: 8,
            sources: {
              map: { type: "raster", url: archive("map"), tileSize: 256 },
              shade: dem,
              land: dem,
              contours: { type: "geojson", data: `${location.origin}/bake/vector/contours.geojson` },
            },
            layers: [
              { id: "ground", type: "background", paint: { "background-color": "#fff" } },
              { id: "map", type: "raster", source: "map" },
              { id: "hillshade", type: "hillshade", source: "shade" },
              { id: "contours", type: "line", source: "contours", paint: { "line-color": "#c0f", "line-width": 1 } },
            ],
          },
        });
        map.addControl(new maplibregl.ScaleControl({ maxWidth: 200 }));
        await map.once("load");
      }
      for (const id of ["map", "hillshade", "contours"]) map.setLayoutProperty(id, "visibility", layers.includes(id) ? "visible" : "none");
      map.setTerrain(layers.includes("terrain") ? { source: "land", exaggeration: 1 } : null);
      map.jumpTo({ pitch: 0, bearing: 0, ...map.cameraForBounds(bounds), ...view });
      await map.once("idle");
    },
    bounds,
    layers,
    view,
  );
}

async function shoot(page, name) {
  const bytes = await page.screenshot();
  if (pictures) fs.writeFileSync(path.join(pictures, `${name}.png`), bytes);
  // How light the pixels in the middle of the window are: mean, deviation, and all of them.
  const pixels = await pixelsOf(page, bytes, 0.5);
  const light = pixels.map((pixel) => ((pixel & 255) + ((pixel >> 8) & 255) + ((pixel >> 16) & 255)) / 3);
  const mean = light.reduce((sum, it) => sum + it, 0) / light.length;
  return { light, mean, deviation: Math.sqrt(light.reduce((sum, it) => sum + (it - mean) ** 2, 0) / light.length) };
}

async function main(browser, faults) {
  const server = await served();
  const page = await browser.newPage();
  page.on("pageerror", (error) => faults.push(String(error)));
  page.on("console", (message) => message.type() === "error" && faults.push(message.text()));
  await page.setViewport(SIZE);
  await page.goto(`http://127.0.0.1:${server.address().port}/`);

  const ground = JSON.parse(fs.readFileSync(path.join(bake, "web/map.js"), "utf8").replace(/^terrane\.map\(|\);\n$/g, "")).ground;
  const [west, south, east, north] = ground.bounds_m;
  const { features } = JSON.parse(fs.readFileSync(path.join(bake, "vector/contours.geojson"), "utf8"));
  const points = features.flatMap(({ geometry, properties }) => geometry.coordinates.map((place) => ({ place, metres: properties.height_m })));
  const box = (places) => [0, 1].flatMap((axis) => [Math.min(...places.map((it) => it[axis])), Math.max(...places.map((it) => it[axis]))]);
  const bounds = await page.evaluate(async () => (await new pmtiles.PMTiles(`${location.origin}/bake/web/terrain.pmtiles`).getHeader()));
  const tiles = [[bounds.minLon, bounds.minLat], [bounds.maxLon, bounds.maxLat]];
  const [low, high] = tiles;
  const [x0, x1, y0, y1] = points.reduce(([a, b, c, d], { place: [x, y] }) => [Math.min(a, x), Math.max(b, x), Math.min(c, y), Math.max(d, y)], box([points[0].place]));
  const inside = x0 > low[0] - 1e-6 && x1 < high[0] + 1e-6 && y0 > low[1] - 1e-6 && y1 < high[1] + 1e-6;
  const share = ((x1 - x0) * (y1 - y0)) / ((high[0] - low[0]) * (high[1] - low[1]));
  check(inside && share > 0.5, "contours lie within the bounds of the tiles", `${(100 * share).toFixed(0)} % of them`);

  await shown(page, tiles, ["hillshade"]);
  const shade = await shoot(page, "hillshade");
  check(shade.deviation > 8, "the hillshade is not flat", `light ${shade.mean.toFixed(0)}, ${shade.deviation.toFixed(1)} about it`);

  await shown(page, tiles, ["map", "contours", "terrain"]);
  await shoot(page, "contours");
  // MapLibre's Earth is a ball of 6,371,009 m, that of Web Mercator one of 6,378,137.
  const across = await page.evaluate(([a, b]) => [new maplibregl.LngLat(...a).distanceTo(new maplibregl.LngLat(b[0], a[1])), new maplibregl.LngLat(...a).distanceTo(new maplibregl.LngLat(a[0], b[1]))], tiles);
  const off = Math.max(Math.abs(across[0] / (east - west) - 1), Math.abs(across[1] / (north - south) - 1));
  check(off < 0.01, "MapLibre measures the region as wide and high as it is", `${across.map((m) => m.toFixed(0))} of ${east - west}, ${north - south} m`);
  const [bar_m, bar_px] = await page.$eval(".maplibregl-ctrl-scale", (bar) => [Number.parseFloat(bar.textContent) * (bar.textContent.includes("km") ? 1e3 : 1), bar.getBoundingClientRect().width]);
  const region_px = await page.evaluate(([a, b]) => map.project(b).x - map.project(a).x, tiles);
  const pixel_m = (east - west) / region_px;
  check(Math.abs(bar_m / bar_px / pixel_m - 1) < 0.05, "its scale bar is right", `${bar_m} m are ${bar_px.toFixed(0)} px of ${pixel_m.toFixed(2)} m`);

  // Heights where contours are, at the finest zoom.
  const middle = [(low[0] + high[0]) / 2, (low[1] + high[1]) / 2];
  await shown(page, tiles, ["map", "terrain"], { center: middle, zoom: ground.max_zoom - 1 });
  const near = await page.evaluate(() => map.getBounds().toArray());
  const seen = points.filter(({ place }) => [0, 1].every((axis) => place[axis] > near[0][axis] && place[axis] < near[1][axis])).slice(0, 3000);
  const told = await page.evaluate((places) => places.map((place) => map.queryTerrainElevation(place)), seen.map(({ place }) => place));
  const errors = told.map((metres, at) => Math.abs(metres - seen[at].metres));
  const range = Math.max(...told) - Math.min(...told);
  check(seen.length > 100 && range > 20, "the terrain is not flat", `${range.toFixed(0)} m at ${seen.length} places`);
  check(median(errors) < 0.02 * range + 1, "contours lie where the terrain has their height", `${median(errors).toFixed(2)} m off in the median`);

  // From the side, in three dimensions and as a plane.
  const aside = { center: middle, pitch: 60, bearing: 20 };
  await shown(page, tiles, ["map", "hillshade"], aside);
  const plane = await shoot(page, "aside-plane");
  await shown(page, tiles, ["map", "hillshade", "terrain"], aside);
  await wait(300);
  const relief = await shoot(page, "aside-terrain");
  const differing = relief.light.filter((light, at) => Math.abs(light - plane.light[at]) > 8).length / relief.light.length;
  check(differing > 0.2, "from the side mountains rise", `${(100 * differing).toFixed(0)} % of the pixels differ from the plane`);
  await page.close();
  server.close();
}

if (pictures) fs.mkdirSync(pictures, { recursive: true });
// As the last word of the kind, since --disable-gpu would take WebGL away.
const flags = ["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--ignore-gpu-blocklist"];
run(puppeteer, { name: "maplibre", flags, pictures, noFault: "no error" }, main);
