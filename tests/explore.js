// Uses the explorer's page as people do, in a headless Chromium, and looks whether it does what they expect:
//   node tests/explore.js FOLDER-OF-NODE_MODULES ADDRESS [FOLDER-FOR-SCREENSHOTS]
// The first must hold puppeteer-core; CHROMIUM names the browser, or it is the `chromium` of the path. The address is
// what `terrane explore` prints; the test waits for drafts, and for the full picture of a tile only where it must. Any
// access to another host is a failure. Prints one line a check, with a figure; exits with 1 if one has failed.
const path = require("path");
const { createRequire } = require("module");
const { check, checkFit, fingersOf, near, run, state, wait } = require("./browser.js");

const [modules, address, pictures] = process.argv.slice(2);
const puppeteer = createRequire(path.resolve(modules, "node_modules", "x"))("puppeteer-core");
const PAGE = new URL("/", address);
const DESK = { width: 1280, height: 800, deviceScaleFactor: 1 };
const PHONE = { width: 390, height: 844, deviceScaleFactor: 2, isMobile: true, hasTouch: true };
const SLOW_MS = 180000; // until a picture in full, a plan or a search is there

const text = (page, selector) => page.$eval(selector, (element) => element.textContent);
const until = (page, what, ...rest) => page.waitForFunction(what, { polling: 60, timeout: SLOW_MS }, ...rest);
const drafted = (page) => until(page, () => terrane.about() && terrane.state().tiles > 0 && terrane.state().lacking.draft === 0);

async function shoot(page, name) {
  if (pictures) await page.screenshot({ path: path.join(pictures, `${name}.png`) });
}

// When nothing moves, whatever still loads.
async function settled(page) {
  await wait(80);
  await until(page, () => !terrane.state().moving);
  await wait(60);
  return state(page);
}

// A page whose faults are counted. Answers that tell a mistake or a busy server are part of the play.
async function opened(browser, viewport, faults, query = "") {
  const page = await browser.newPage();
  page.on("pageerror", (error) => faults.push(String(error)));
  page.on("console", (message) => {
    if (message.type() === "error" && !/status of (400|409|422|503)/.test(message.text())) faults.push(message.text());
  });
  page.on("request", (request) => {
    const url = new URL(request.url());
    if (!["data:", "blob:"].includes(url.protocol) && url.host !== PAGE.host) faults.push(`another host: ${url.href}`);
  });
  await page.setViewport(viewport);
  page.begun = Date.now();
  await page.goto(PAGE.href + query);
  await until(page, () => window.terrane !== undefined || typeof terrane !== "undefined");
  await until(page, () => terrane.about() !== null);
  return page;
}

async function drag(page, from, to, steps, pause = 0) {
  await page.mouse.move(...from);
  await page.mouse.down();
  for (let step = 1; step <= steps; step++) {
    await page.mouse.move(...[0, 1].map((axis) => from[axis] + ((to[axis] - from[axis]) * step) / steps));
    await wait(12);
  }
  await wait(pause);
  await page.mouse.up();
}

// Times while the map is pushed about and zoomed, in milliseconds, the middle one and the 95th of a hundred: between frames that
// Chromium's trace has as drawn, and of the page's own work in a frame, which is what it can answer for: a machine without a GPU
// draws slowly by itself.
async function smoothness(page) {
  await page.evaluate(() => {
    const said = (window.frames_ = { work: [] });
    const old = window.requestAnimationFrame;
    window.requestAnimationFrame = (act) =>
      old.call(window, (now) => {
        const begun = performance.now();
        act(now);
        said.work.push(performance.now() - begun);
      });
    said.stop = () => (window.requestAnimationFrame = old);
  });
  await page.tracing.start({ categories: ["disabled-by-default-devtools.timeline.frame"] });
  for (let turn = 0; turn < 4; turn++) {
    await drag(page, [900, 300], [500, 520], 30);
    await wait(250);
    for (let step = 0; step < 8; step++) {
      await page.mouse.wheel({ deltaY: turn % 2 ? 60 : -60 });
      await wait(30);
    }
    await drag(page, [500, 500], [850, 300], 30);
    await wait(250);
  }
  const { traceEvents } = JSON.parse(new TextDecoder().decode(await page.tracing.stop()));
  const drawn = traceEvents.filter(({ name }) => name === "DrawFrame").map(({ ts }) => ts / 1000);
  drawn.sort((a, b) => a - b);
  const between = drawn.slice(1).map((now, index) => now - drawn[index]);
  const work = await page.evaluate(() => {
    window.frames_.stop();
    return window.frames_.work;
  });
  const at = (values, share) => values.sort((a, b) => a - b)[Math.floor(values.length * share)];
  return [between, work].map((values) => [0.5, 0.95].map((share) => at(values, share)));
}

async function onDesk(browser, faults) {
  const page = await opened(browser, DESK, faults);
  const { begun } = page;
  const since = () => `${((Date.now() - begun) / 1000).toFixed(1)} s from the beginning`;
  const first = await until(page, () => performance.getEntriesByType("resource").find(({ name }) => /\/(glance|draft)\//.test(name))?.name);
  check((await first.jsonValue()).includes("/glance/"), "a glance comes first", since());
  await drafted(page);
  check(true, "drafts of all that is on the screen come", since());
  await shoot(page, "desk-draft");
  const start = await state(page);

  // The hand.
  const anchor = [820, 330];
  await page.mouse.move(...anchor);
  await wait(80);
  const before = await page.evaluate((at) => terrane.toMetres({ x: at[0], y: at[1] }), anchor);
  for (let turn = 0; turn < 3; turn++) await page.mouse.wheel({ deltaY: -120 });
  let now = await settled(page);
  const after = await page.evaluate((at) => terrane.toMetres({ x: at[0], y: at[1] }), anchor);
  check(now.zoom > start.zoom + 0.8, "the wheel zooms in", `${start.zoom.toFixed(2)} to ${now.zoom.toFixed(2)}`);
  const apart = Math.hypot(after[0] - before[0], after[1] - before[1]) / now.pixel_m;
  check(apart < 1, "around the pointer", `${apart.toFixed(3)} px off`);
  let last = now;
  await drag(page, [700, 420], [520, 350], 10, 150);
  now = await settled(page);
  const moved = [(now.east_m - last.east_m) / now.pixel_m, (now.north_m - last.north_m) / now.pixel_m];
  check(near(moved[0], 180, 1) && near(moved[1], -70, 1), "a drag moves the map with the hand", moved.map((px) => px.toFixed(1)));
  await page.keyboard.press("0");
  now = await settled(page);
  check(near(now.east_m, start.east_m, 1) && near(now.zoom, start.zoom, 1e-6), "0 goes back to where it began", `zoom ${now.zoom}`);

  // West and north of the origin, tiles have negative numbers.
  await page.evaluate(() => terrane.look({ at_m: [-1234567, 7654321], pixel_m: 80 }));
  await drafted(page);
  now = await state(page);
  check(now.missing.length === 0 && now.east_m < 0, "the world has no end", `${(now.east_m / 1e3).toFixed(0)} km east, ${(now.north_m / 1e3).toFixed(0)} km north`);
  await page.keyboard.press("0");
  await settled(page);

  const [[middle, most], [work, workMost]] = await smoothness(page);
  check(workMost < 12, "frames leave room for 60 a second while tiles arrive", `${work.toFixed(1)} ms of work, 95th of 100 ${workMost.toFixed(1)} ms; ${middle.toFixed(1)} and ${most.toFixed(1)} ms between frames`);
  await page.keyboard.press("0");
  await settled(page);
  await drafted(page);

  // What is under the pointer.
  await page.mouse.move(700, 420);
  await until(page, () => document.getElementById("height").textContent !== "");
  // Of coarser land first, which says so.
  const stages = () => performance.getEntriesByType("resource").flatMap(({ name }) => /\/heights\/(glance|draft)\//.exec(name)?.[1] ?? []);
  await until(page, () => /^[^\u2248]/.test(document.getElementById("height").textContent));
  check((await page.evaluate(stages))[0] === "glance", "a height is there soon, and better soon after", await text(page, "#height"));
  const told = await Promise.all(["#at", "#height", "#slope", "#tile"].map((id) => text(page, id)));
  check(/m$/.test(told[1]) && /\u00b0$/.test(told[2]) && /^tile \u2212?\d+, \u2212?\d+$/.test(told[3]), "height, slope and tile are told", told.join(", "));

  await until(page, () => document.getElementById("memory").textContent !== "");
  const [held, mostHeld] = (await text(page, "#memory")).match(/\d+/g).map(Number);
  check(held > 0 && held <= mostHeld, "it tells how much it remembers", await text(page, "#memory"));

  // One tile in full tells that there are more; pictures are of all.
  const lacks = (await state(page)).lacking.full;
  await until(page, (most) => terrane.state().lacking.full <= most, pictures ? 0 : Math.max(0, lacks - 1));
  check(true, "tiles are drawn in full", since());
  await wait(1500);
  await shoot(page, "desk");
  return page;
}

async function searching(page) {
  await page.mouse.move(640, 760);
  await page.keyboard.press("/");
  await wait(100);
  await shoot(page, "desk-names");
  await page.keyboard.type("peak > 1000 m");
  const rows = await page.$$eval("#found li b", (rows) => rows.map((row) => row.textContent));
  check(rows.some((row) => row.startsWith("Look for")), "a search for features is offered", rows.join(", "));
  await page.keyboard.press("Enter");
  await wait(200);
  check((await text(page, "#features-title")).startsWith("Looking for"), "it tells that it looks", await text(page, "#features-title"));
  await until(page, () => !document.querySelector("#features-title.busy"));
  const found = await page.$$eval("#features-list b", (rows) => rows.map((row) => row.textContent));
  check(found.length > 0, "and finds some", `${await text(page, "#features-title")}: ${found.slice(0, 3).join(", ")}`);
  await shoot(page, "desk-features");
  await page.click("#features-list button");
  const before = await state(page);
  const now = await settled(page);
  check(now.east_m !== before.east_m || now.pixel_m !== before.pixel_m, "a click goes there", `${(now.east_m / 1e3).toFixed(1)} km E, ${(now.north_m / 1e3).toFixed(1)} km N`);
  await drafted(page);
  await shoot(page, "desk-found");
  await page.click("#features-close");
  await page.keyboard.press("/");
  await page.$eval("#query", (input) => (input.value = ""));
  await page.keyboard.type("xyzzy < 3 dragons");
  await page.keyboard.press("Enter");
  await until(page, () => !document.querySelector("#features-title.busy"));
  check((await text(page, "#features")).length > 20, "what it does not understand is told with a hint", (await text(page, "#features-title")).slice(0, 80));
  await page.click("#features-close");
  await page.evaluate(() => document.activeElement.blur());
}

async function baking(page) {
  await page.keyboard.press("Home");
  await settled(page);
  await page.keyboard.press("b");
  await wait(100);
  await drag(page, [560, 300], [830, 520], 12);
  await wait(60);
  const size = await text(page, "#bake-size");
  check(/\u00d7/.test(size), "a drawn rectangle is told", size);
  await until(page, () => document.querySelector("#bake-plan dd") && !document.querySelector("#bake-plan.old"));
  const [command, plan] = [await text(page, "#bake-command code"), await text(page, "#bake-plan")];
  const [x, y, cols, rows] = await Promise.all(["x", "y", "cols", "rows"].map((key) => page.$eval(`#bake-${key}`, (input) => Number(input.value))));
  check(command.includes(`--size ${cols}x${rows}`) && command.includes(`${x},${y}`), "with the command that bakes it", command);
  check(/iB/.test(plan), "and what it takes", plan);
  await shoot(page, "desk-bake");
  // A corner is a handle.
  const corner = await page.evaluate((x, y, side) => terrane.toScreen([x * side, -y * side]), x + cols, y + rows, await page.evaluate(() => terrane.about().tile_cells * terrane.about().spacing_m));
  const tile = await page.evaluate(() => (terrane.about().tile_cells * terrane.about().spacing_m) / terrane.state().pixel_m);
  await drag(page, [corner.x - 1, corner.y - 1], [corner.x - 1 + 2 * tile, corner.y - 1 + tile], 8);
  const grown = await Promise.all(["cols", "rows"].map((key) => page.$eval(`#bake-${key}`, (input) => Number(input.value))));
  check(grown[0] === cols + 2 && grown[1] === rows + 1, "a handle makes it larger", `${cols} x ${rows} to ${grown.join(" x ")}`);

  const ready = () => until(page, () => !document.querySelector("#bake-plan.old") && !document.getElementById("bake-go").disabled);
  const says = (what) => until(page, (what) => !document.getElementById("bake-fault").hidden && [...document.querySelectorAll("#bake-fault button")].some(({ textContent }) => textContent === what), what);
  const press = (what) => page.$$eval("#bake-fault button", (buttons, what) => buttons.find(({ textContent }) => textContent === what).click(), what);
  const isDone = () => until(page, () => !document.getElementById("bake-done").hidden && document.querySelector("#bake-done img").naturalWidth > 0);
  await page.select("#bake-profile", "blender");
  await until(page, () => document.querySelector("#bake-command code").textContent.includes("--profile blender"));
  await ready();
  check((await text(page, "#bake-command code")).endsWith("--profile blender --export map"), "a profile has files of its own", await text(page, "#bake-plan"));
  await shoot(page, "desk-bake-profile");
  await page.select("#bake-profile", "");
  // One that takes some seconds, and does not get them.
  for (const key of ["cols", "rows"]) await page.$eval(`#bake-${key}`, (input) => ((input.value = 16), input.dispatchEvent(new Event("change"))));
  await ready();
  await page.click("#bake-go");
  // Before it tells of tiles it has left nothing to go on with.
  await until(page, () => / of /.test(document.querySelector("#bake-progress p").textContent));
  await page.click("#bake-go");
  await says("Go on with it");
  check(true, "a bake that is cancelled can go on", await text(page, "#bake-fault div"));
  await shoot(page, "desk-bake-cancelled");
  await press("Go on with it");
  await isDone();
  check(true, "and is done", (await text(page, "#bake-done p")).trim());
  await shoot(page, "desk-baked");
  await checkFit(page, DESK, ["head", "layers", "zoom", "foot", "bake"]);
  await page.click("#bake-go");
  await says("Replace it");
  check(true, "once more it is in the way, and can be replaced", await text(page, "#bake-fault div"));
  await page.keyboard.press("Escape");
  check(await page.$eval("#bake", ({ hidden }) => hidden), "Escape puts it away", "hidden");
}

async function sliding(page) {
  await page.evaluate(() => document.activeElement.blur());
  await page.keyboard.press("p");
  await until(page, () => document.querySelectorAll("#keys .key").length > 10);
  const count = await page.$$eval("#keys .key", ({ length }) => length);
  check(count > 10, "the preset's keys are there", `${count} keys`);
  const before = await page.evaluate(() => terrane.about().id);
  const key = await page.$eval("#keys details[open] .key input[type=range]", (range) => {
    range.scrollIntoView({ block: "center" });
    return range.closest(".key").dataset.key;
  });
  const box = await (await page.$("#keys details[open] .key input[type=range]")).boundingBox();
  await drag(page, [box.x + box.width * 0.4, box.y + box.height / 2], [box.x + box.width * 0.55, box.y + box.height / 2], 8);
  await until(page, (before) => terrane.about().id !== before, before);
  check(true, "a slider makes another world", `${key}, ${await page.evaluate(() => terrane.about().set.join(" "))}`);
  check((await page.url()).includes("set="), "which the address keeps", decodeURIComponent(await page.evaluate(() => location.search)));
  await drafted(page);
  await shoot(page, "desk-sliders");
  const moved = await page.evaluate(() => terrane.about().id);
  await page.click("#reset");
  await until(page, (moved) => terrane.about().id !== moved, moved);
  check((await page.evaluate(() => terrane.about().id)) === before, "and all can be reset", before);
  // A value out of its range is told with its place.
  await page.$eval("#keys details[open] .key input[type=number]", (input) => {
    input.value = "-123456789";
    input.dispatchEvent(new Event("change"));
  });
  await until(page, () => !document.getElementById("notice").hidden);
  check((await text(page, "#notice b")).length > 10, "a faulty value is told", (await text(page, "#notice")).replace(/\s+/g, " ").slice(0, 120));
  await shoot(page, "desk-faulty");
  await page.click("#notice > button");
  await page.click("#reset");
  await wait(400);
  await page.click("#sliders-close");
  await page.evaluate(() => document.activeElement.blur());
}

async function inThree(page) {
  await page.keyboard.press("0");
  await settled(page);
  await drafted(page);
  await page.keyboard.press("3");
  await wait(400);
  check(await page.$eval("#scene", ({ hidden }) => !hidden), "3 shows the land in three dimensions", "shown");
  await until(page, () => document.getElementById("scene").dataset.tiles > 0 && document.getElementById("scene").dataset.lacks === "0" && document.getElementById("scene").dataset.risen === "1");
  await wait(600);
  await shoot(page, "desk-scene");
  // What is drawn has colours of land in its middle.
  const colours = await page.evaluate(
    () =>
      new Promise((resolve) => {
        terrane.hooks.drawn_ = terrane.hooks.drawn;
        terrane.hooks.drawn = (lacking) => {
          terrane.hooks.drawn = terrane.hooks.drawn_;
          const small = new OffscreenCanvas(64, 40);
          const context = small.getContext("2d");
          context.drawImage(document.getElementById("scene"), 0, 0, 64, 40);
          const data = context.getImageData(16, 10, 32, 20).data;
          const seen = new Set();
          for (let i = 0; i < data.length; i += 4) if (data[i + 3] > 200) seen.add(`${data[i] >> 3},${data[i + 1] >> 3},${data[i + 2] >> 3}`);
          terrane.hooks.drawn(lacking);
          resolve(seen.size);
        };
        terrane.invalidate();
      }),
  );
  check(colours > 20, "with the tiles' pictures on it", `${colours} colours`);
  await drag(page, [700, 400], [560, 360], 10);
  await wait(600);
  await shoot(page, "desk-scene-turned");
  await page.keyboard.press("Escape");
  check(await page.$eval("#scene", ({ hidden }) => hidden), "and Escape the map", "hidden");
}

async function sideBySide(page, faults) {
  await page.keyboard.press("2");
  await until(page, () => document.querySelectorAll("#pair iframe").length === 2);
  let frames = [];
  for (let turn = 0; turn < 100 && frames.length < 2; turn++) {
    await wait(100);
    frames = page.frames().filter((frame) => frame.url().includes("embedded="));
  }
  for (const frame of frames) await frame.waitForFunction(() => typeof terrane !== "undefined" && terrane.about() && terrane.state().tiles > 0 && terrane.state().lacking.draft === 0, { timeout: SLOW_MS });
  await shoot(page, "desk-pair");
  const seeds = await Promise.all(frames.map((frame) => frame.evaluate(() => terrane.about().seed)));
  check(frames.length === 2 && seeds[0] !== seeds[1], "two worlds stand side by side", `seeds ${seeds.join(" and ")}`);
  await drag(page, [300, 420], [200, 360], 10, 150);
  await wait(500);
  const [one, other] = await Promise.all(frames.map((frame) => frame.evaluate(() => terrane.looking())));
  const apart = Math.hypot(one.at_m[0] - other.at_m[0], one.at_m[1] - other.at_m[1]) / one.pixel_m;
  check(apart < 1 && one.at_m[0] !== 0, "and follow each other", `${apart.toFixed(2)} px apart`);
  await page.click("#pair > button");
  await wait(300);
  const now = await page.evaluate(() => terrane.looking());
  check(Math.hypot(now.at_m[0] - one.at_m[0], now.at_m[1] - one.at_m[1]) < 2 * now.pixel_m, "one world stays where they were", faults.length);
}

async function onPhone(browser, faults) {
  const page = await opened(browser, PHONE, faults);
  await drafted(page);
  await shoot(page, "phone");
  await checkFit(page, PHONE);
  const start = await state(page);
  const move = await fingersOf(page);
  await move([{ from: [195, 400], by: [0, -3] }, { from: [195, 460], by: [0, 3] }]);
  const now = await settled(page);
  check(near(now.zoom - start.zoom, 1, 0.1), "two fingers zoom as far as they spread", `${(now.zoom - start.zoom).toFixed(2)} levels for 2 times`);
  await page.tap("#tool-bake");
  await wait(150);
  await move([{ from: [120, 260], by: [15, 12] }]);
  await wait(1500);
  check(/\u00d7/.test(await text(page, "#bake-size")), "a finger draws a rectangle", await text(page, "#bake-size"));
  await shoot(page, "phone-bake");
  await page.tap("#bake-close");
  await page.tap("#tool-sliders");
  await until(page, () => document.querySelectorAll("#keys .key").length > 10);
  await wait(300);
  await shoot(page, "phone-sliders");
  await page.tap("#sliders-close");
  await drafted(page);
  await page.tap("#tool-scene");
  await until(page, () => document.getElementById("scene").dataset.risen === "1");
  await wait(600);
  await shoot(page, "phone-scene");
  await page.tap("#tool-scene");
  check(await page.$eval("#scene", ({ hidden }) => hidden), "a phone shows the land in three dimensions too", "and the map again");
  await page.close();
}

// Without a GPU, WebGL is computed by the CPU.
const options = { name: "explore", flags: ["--enable-unsafe-swiftshader"], pictures, noFault: "no error and no other host" };
run(puppeteer, options, async (browser, faults) => {
  const page = await onDesk(browser, faults);
  for (const part of [searching, baking, sliding, inThree]) await part(page);
  await sideBySide(page, faults);
  await page.close();
  await onPhone(browser, faults);
});
