// Uses a web map as people do, in a headless Chromium, and looks whether it does what they expect:
//   node tests/web.js FOLDER-OF-NODE_MODULES MAP-FOLDER [FOLDER-FOR-SCREENSHOTS]
// The first must hold puppeteer-core; CHROMIUM names the browser, or it is the `chromium` of the path. The map must have
// two layers, heights and names. The page is opened from the disk, and any access to a network is a failure. Prints one
// line a check, with a figure; exits with 1 if one has failed.
const fs = require("fs");
const path = require("path");
const { createRequire } = require("module");
const { pathToFileURL } = require("url");
const { check, checkFit, fingersOf, near, run, state, wait } = require("./browser.js");

const [modules, folder, pictures] = process.argv.slice(2);
const puppeteer = createRequire(path.resolve(modules, "node_modules", "x"))("puppeteer-core");
const PAGE = pathToFileURL(path.resolve(folder, "index.html")).href;
const DESK = { width: 1280, height: 800, deviceScaleFactor: 1 };
const PHONE = { width: 375, height: 667, deviceScaleFactor: 2, isMobile: true, hasTouch: true };

const text = (page, id) => page.$eval(`#${id}`, (element) => element.textContent);

// When nothing has moved or loaded for a while.
async function settled(page) {
  await wait(60);
  await page.waitForFunction(() => terrane.state().still, { polling: 50, timeout: 20000 });
  await wait(120);
  return state(page);
}

async function shoot(page, name) {
  if (pictures) await page.screenshot({ path: path.join(pictures, `${name}.png`) });
}

// The share of pixels in the middle of the window that differ, of two screenshots.
async function differing(page, a, b) {
  const urls = [a, b].map((bytes) => `data:image/png;base64,${Buffer.from(bytes).toString("base64")}`);
  return page.evaluate(async (urls) => {
    const read = async (url) => {
      const image = new Image();
      image.src = url;
      await image.decode();
      const canvas = new OffscreenCanvas(image.width, image.height);
      const context = canvas.getContext("2d");
      context.drawImage(image, 0, 0);
      const [w, h] = [image.width, image.height];
      return context.getImageData(w / 4, h / 4, w / 2, h / 2).data;
    };
    const [one, other] = [await read(urls[0]), await read(urls[1])];
    let count = 0;
    for (let i = 0; i < one.length; i += 4) count += Math.abs(one[i] - other[i]) > 8;
    return count / (one.length / 4);
  }, urls);
}

async function opened(browser, viewport, faults, hash = "") {
  const page = await browser.newPage();
  page.on("pageerror", (error) => faults.push(String(error)));
  page.on("console", (message) => message.type() === "error" && faults.push(message.text()));
  page.on("requestfailed", (request) => faults.push(`${request.url()} ${request.failure()?.errorText}`));
  page.on("request", (request) => /^(file|data|blob):/.test(request.url()) || faults.push(`network: ${request.url()}`));
  await page.setViewport(viewport);
  await page.goto(PAGE + hash);
  await page.waitForFunction(() => terrane.state().tiles > 0);
  await settled(page);
  return page;
}

async function drag(page, from, to, steps, pause) {
  await page.mouse.move(...from);
  await page.mouse.down();
  for (let step = 1; step <= steps; step++) {
    const at = [0, 1].map((axis) => from[axis] + ((to[axis] - from[axis]) * step) / steps);
    await page.mouse.move(...at);
    await wait(12);
  }
  await wait(pause);
  await page.mouse.up();
}

async function onDesk(browser, about, names, faults) {
  const page = await opened(browser, DESK, faults);
  await shoot(page, "desk");
  const [west, south, east, north] = about.ground.bounds_m;
  const start = await state(page);
  const inside = DESK.width * start.pixel_m >= east - west && DESK.height * start.pixel_m >= north - south;
  check(inside, "the whole map is shown first", `${start.pixel_m.toFixed(2)} m a pixel`);

  const empty = await page.screenshot();
  await page.evaluate(() => document.activeElement.blur());
  // The wheel keeps what is under the pointer.
  const anchor = [DESK.width / 2 + 130, DESK.height / 2 - 40];
  await page.mouse.move(...anchor);
  await wait(50);
  const before = await text(page, "at");
  for (let turn = 0; turn < 6; turn++) await page.mouse.wheel({ deltaY: -120 });
  let now = await settled(page);
  check(now.zoom > start.zoom + 1.5, "the wheel zooms in", `${start.zoom.toFixed(2)} to ${now.zoom.toFixed(2)}`);
  const kilometres = (told) => told.match(/[\d.]+/g).map(Number);
  const after = await text(page, "at");
  const apart = Math.max(...kilometres(before).map((km, axis) => Math.abs(km - kilometres(after)[axis])));
  check(apart * 1e3 < 2 * start.pixel_m + 60, "around the pointer", `${before} and ${after}`);
  check((await differing(page, empty, await page.screenshot())) > 0.3, "and the picture is another", "more than 30 %");
  await shoot(page, "desk-wheel");

  // A drag that stops before it lets go moves by as many pixels as the hand.
  let last = now;
  await drag(page, [700, 420], [520, 350], 10, 150);
  now = await settled(page);
  const moved = [(now.east_m - last.east_m) / now.pixel_m, (now.north_m - last.north_m) / now.pixel_m];
  check(near(moved[0], 180, 1) && near(moved[1], -70, 1), "a drag moves the map with the hand", moved.map((px) => px.toFixed(1)));
  last = now;
  await drag(page, [700, 420], [600, 420], 6, 0);
  now = await settled(page);
  const thrown = (now.east_m - last.east_m) / now.pixel_m;
  check(thrown > 130, "a map that is thrown goes on", `${thrown.toFixed(0)} px of a drag of 100`);

  // Keys.
  last = now;
  await page.keyboard.press("ArrowLeft");
  now = await settled(page);
  check(near((now.east_m - last.east_m) / now.pixel_m, -140, 2), "an arrow moves it", `${((now.east_m - last.east_m) / now.pixel_m).toFixed(1)} px`);
  last = now;
  await page.keyboard.press("-");
  now = await settled(page);
  check(now.zoom < last.zoom && Number.isInteger(Math.round(now.zoom * 1e6) / 1e6), "minus zooms out to a level", now.zoom);
  await page.keyboard.press("+");
  check((await settled(page)).zoom === now.zoom + 1, "plus zooms in by one", now.zoom + 1);
  now = await state(page);
  await page.mouse.click(640, 400, { count: 2, delay: 20 });
  check((await settled(page)).zoom > now.zoom, "a double click zooms in", (await state(page)).zoom);
  await page.keyboard.press("0");
  now = await settled(page);
  check(near(now.zoom, start.zoom, 1e-6) && near(now.east_m, start.east_m, 1), "0 shows all again", now.zoom.toFixed(2));

  // Search: the last of those that are not near an edge, beyond which the map cannot be moved.
  const inner = (at, from, to) => Math.abs(at - (from + to) / 2) < (to - from) / 4;
  const central = names.filter(([, , x, y]) => inner(x, west, east) && inner(y, south, north));
  const [name, , nameEast, nameNorth] = central[central.length - 1];
  await page.keyboard.press("/");
  await shoot(page, "desk-names");
  await page.keyboard.type(name.slice(0, Math.max(3, name.length - 1)));
  await shoot(page, "desk-search");
  const rows = await page.$$eval("#found li b", (rows) => rows.map((row) => row.textContent));
  check(rows.includes(name), "search finds a name", rows.join(", "));
  for (let row = 0; row < rows.indexOf(name); row++) await page.keyboard.press("ArrowDown");
  await page.keyboard.press("Enter");
  now = await settled(page);
  const off = Math.hypot(now.east_m - nameEast, now.north_m - nameNorth) / now.pixel_m;
  check(off < 1, "Enter goes to it", `${name}, ${off.toFixed(2)} px off`);
  check((await text(page, "near")).startsWith(name), "and tells it", await text(page, "near"));
  await shoot(page, "desk-found");
  await page.keyboard.press("Escape");
  await page.keyboard.press("/");
  await page.keyboard.type("qqqqq");
  check((await text(page, "found")) === "No such name", "what is not there is not found", await text(page, "found"));
  await page.keyboard.press("Escape");

  await heightsAgree(page, about);

  // Layers.
  now = await state(page);
  const map = await page.screenshot();
  const [, other] = await page.$$("#layers button");
  await other.click();
  await settled(page);
  check((await state(page)).layer === about.layers[1].name, "the other layer is shown", (await state(page)).layer);
  check((await differing(page, map, await page.screenshot())) > 0.3, "and looks different", "more than 30 %");
  await shoot(page, "desk-relief");
  const again = await opened(browser, DESK, faults, await page.evaluate(() => location.hash));
  const [there, here] = [await state(again), await state(page)];
  const same = near(there.east_m, here.east_m, 2) && near(there.zoom, here.zoom, 1e-3) && there.layer === here.layer;
  check(same, "the address brings back the view", await again.evaluate(() => location.hash));
  await again.close();

  // As near as it goes, and as far.
  await page.keyboard.press("l");
  for (let press = 0; press < 12; press++) await page.keyboard.press("+");
  now = await settled(page);
  check(now.zoom === about.ground.max_zoom + 2, "there is a nearest", `zoom ${now.zoom}`);
  await shoot(page, "desk-near");
  for (let press = 0; press < 20; press++) await page.keyboard.press("-");
  check((await settled(page)).zoom >= start.zoom - 0.3, "and a farthest", (await state(page)).zoom.toFixed(2));
  check(now.missing.length === 0, "no tile is missing", now.missing.length);
  await page.close();
}

// The heights that the page tells are those of terrain-RGB, which a browser may read here as it comes from this script.
async function heightsAgree(page, about) {
  let most = 0;
  let told = 0;
  for (let point = 0; point < 12; point++) {
    const at = [360 + 55 * point, 180 + ((point * 173) % 400)];
    await page.mouse.move(...at);
    await settled(page);
    const shown = await text(page, "height");
    if (!shown) continue;
    const { zoom, east_m, north_m, pixel_m } = await state(page);
    const { min_zoom, max_zoom, corner_m, finest_m } = about.ground;
    const z = Math.min(Math.max(Math.round(zoom), min_zoom), max_zoom);
    const pixel = [east_m + (at[0] - DESK.width / 2) * pixel_m - corner_m[0], corner_m[1] - north_m + (at[1] - DESK.height / 2) * pixel_m];
    const [x, y] = pixel.map((metres) => metres / (finest_m * 2 ** (max_zoom - z)));
    const [column, row] = [x, y].map((at) => Math.floor(at / 256));
    const file = path.join(folder, "terrain", String(z), String(column), `${row}.${about.ending}`);
    const url = `data:image/${about.ending};base64,${fs.readFileSync(file).toString("base64")}`;
    const rgb = await page.evaluate(async (url, x, y) => {
      const image = new Image();
      image.src = url;
      await image.decode();
      const context = new OffscreenCanvas(256, 256).getContext("2d");
      context.drawImage(image, 0, 0);
      return [...context.getImageData(x, y, 1, 1).data];
    }, url, Math.floor(x) - 256 * column, Math.floor(y) - 256 * row);
    const metres = -10000 + (rgb[0] * 65536 + rgb[1] * 256 + rgb[2]) * 0.1;
    // As steep as 1 in 1 within a pixel and between two heights of the page.
    const tolerance = 1 + 2 * finest_m * 2 ** (max_zoom - z);
    const error = Math.abs(Number(shown.replace(/[^\d\u2212]/g, "").replace("\u2212", "-")) - metres);
    most = Math.max(most, error / tolerance);
    told += 1;
  }
  check(told >= 8 && most < 1, "heights are those of terrain-RGB", `${told} places, at most ${(100 * most).toFixed(0)} % of the tolerance off`);
}

async function onPhone(browser, about, names, faults) {
  const page = await opened(browser, PHONE, faults);
  await shoot(page, "phone");
  await checkFit(page, PHONE);
  const start = await state(page);

  // Two fingers, from the middle outwards.
  const move = await fingersOf(page);
  await move([{ from: [187, 290], by: [0, -9] }, { from: [187, 350], by: [0, 9] }]);
  let now = await settled(page);
  check(near(now.zoom - start.zoom, 2, 0.1), "two fingers zoom as far as they spread", `${(now.zoom - start.zoom).toFixed(2)} levels for 4 times`);
  await shoot(page, "phone-pinch");
  let dense = 0;
  page.on("request", (request) => (dense += decodeURIComponent(request.url()).includes("@2x.")));
  let last = now;
  await move([{ from: [200, 400], by: [-6, -8] }], 150);
  now = await settled(page);
  const moved = [(now.east_m - last.east_m) / now.pixel_m, (last.north_m - now.north_m) / now.pixel_m];
  check(near(moved[0], 60, 2) && near(moved[1], 80, 2), "a finger moves it", moved.map((px) => px.toFixed(1)));
  last = now;
  await page.touchscreen.tap(120, 300);
  await wait(80);
  await page.touchscreen.tap(120, 300);
  now = await settled(page);
  check(now.zoom > last.zoom, "a double tap zooms in", now.zoom.toFixed(2));
  await page.tap("#query");
  await page.keyboard.type(names[0][0].slice(0, 3));
  await shoot(page, "phone-search");
  await page.tap("#found li");
  now = await settled(page);
  check(Math.hypot(now.east_m - names[0][2], now.north_m - names[0][3]) < 2 * now.pixel_m, "a tap goes to a name", names[0][0]);
  await shoot(page, "phone-found");
  check(dense > 0 === about.dense, "dense screens have dense tiles", `${dense} in the middle of it`);
  await page.close();
}

const said = (file, key) => new Function("terrane", fs.readFileSync(path.join(folder, file), "utf8")).bind(null, { [key]: (it) => (said.last = it) });
said("map.js", "map")();
const about = said.last;
said("names.js", "names")();
const names = said.last;
run(puppeteer, { name: "web", pictures, noFault: "no error and no network" }, async (browser, faults) => {
  await onDesk(browser, about, names, faults);
  await onPhone(browser, about, names, faults);
});
