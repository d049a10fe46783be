// What the tests of both pages do alike in a headless Chromium.

const fs = require("fs");
const os = require("os");
const path = require("path");

let [done, failed] = [0, 0];
function check(good, what, figure) {
  done += 1;
  failed += !good;
  console.log(`${good ? "ok    " : "FAILED"} ${what}: ${figure}`);
}

const near = (a, b, tolerance) => Math.abs(a - b) <= tolerance;
const wait = (ms) => new Promise((resolve) => setTimeout(resolve, ms));
const state = (page) => page.evaluate(() => terrane.state());

// Whether a page fits on its screen, and none of its panels covers another.
async function checkFit(page, { width, height }, panels = ["head", "layers", "zoom", "foot"]) {
  const wide = await page.evaluate(() => document.documentElement.scrollWidth);
  check(wide <= width, "nothing is wider than the screen", `${wide} px`);
  const apart = await page.evaluate((panels) => {
    const boxes = panels.map((id) => document.getElementById(id).getBoundingClientRect());
    const meet = (a, b) => a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
    return boxes.every((a, i) => boxes.every((b, j) => i === j || !meet(a, b)) && a.left >= 0 && a.right <= innerWidth && a.bottom <= innerHeight);
  }, panels);
  check(apart, "no panel covers another", `${width} x ${height}`);
}

// Fingers on a page: each goes from a place, so far with each of ten steps, and rests before it leaves.
async function fingersOf(page) {
  const client = await page.createCDPSession();
  const touch = (type, points) => client.send("Input.dispatchTouchEvent", { type, touchPoints: points.map(([x, y], id) => ({ x, y, id })) });
  return async (fingers, rest_ms = 0) => {
    await touch("touchStart", fingers.map(({ from }) => from));
    for (let step = 1; step <= 10; step++) {
      await touch("touchMove", fingers.map(({ from, by }) => [from[0] + by[0] * step, from[1] + by[1] * step]));
      await wait(16);
    }
    await wait(rest_ms);
    await touch("touchEnd", []);
  };
}

// The pixels of a PNG, red in the lowest byte: of a share of its width and height in its middle.
async function pixelsOf(page, bytes, share = 1) {
  return page.evaluate(async (url, share) => {
    const image = new Image();
    image.src = url;
    await image.decode();
    const context = new OffscreenCanvas(image.width, image.height).getContext("2d");
    context.drawImage(image, 0, 0);
    const [width, height] = [image.width * share, image.height * share];
    const { data } = context.getImageData((image.width - width) / 2, (image.height - height) / 2, width, height);
    return [...new Uint32Array(data.buffer)];
  }, `data:image/png;base64,${Buffer.from(bytes).toString("base64")}`, share);
}

// Runs a test in a browser of its own, which counts the faults of its pages; tells how many checks there were, and sets the exit
// code.
async function run(puppeteer, { name, flags = [], pictures, noFault }, test) {
  const profile = fs.mkdtempSync(path.join(os.tmpdir(), `terrane-${name}-`));
  if (pictures) fs.mkdirSync(pictures, { recursive: true });
  const browser = await puppeteer.launch({
    executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
    headless: true,
    userDataDir: profile,
    args: ["--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-background-networking", "--disable-component-update", "--disable-sync", ...flags],
  });
  const faults = [];
  try {
    await test(browser, faults);
  } finally {
    await browser.close();
    fs.rmSync(profile, { recursive: true, force: true });
  }
  check(faults.length === 0, noFault, faults.slice(0, 3).join("; ") || "none");
  console.log(`${done} checks, ${failed} failed`);
  process.exitCode = failed > 0 ? 1 : 0;
}

module.exports = { check, checkFit, fingersOf, near, pixelsOf, run, state, wait };
