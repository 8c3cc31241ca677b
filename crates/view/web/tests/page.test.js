/**
 * The page in a browser, with a stand-in for scene, renderer and solver: what pointer, wheel, fingers and keys do, links, layout,
 * what screen readers are told, and that nothing runs while nothing moves.
 */

import assert from "node:assert/strict";
import { mkdirSync, mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { after, before, test } from "node:test";

import { launch, open, wait } from "./browser.js";
import { page } from "./serve.js";

/** @import { Page } from "puppeteer-core" */
/** @import { Pose, Values } from "twinray/types.js" */
/** @import { Window } from "./browser.js" */

/** @type {Awaited<ReturnType<typeof launch>>} */
let chromium;
before(async () => (chromium = await launch()));
after(() => chromium.close());

/**
 * A test on a page of its own, which must not complain of anything.
 * @param {string} name
 * @param {Window} window
 * @param {(page: Page) => Promise<void>} body
 */
function onPage(name, window, body) {
    test(name, async () => {
        const { page, complaints } = await open(chromium, { still: true, ...window });
        try {
            await body(page);
            assert.deepEqual(complaints, []);
        } finally {
            await page.close();
        }
    });
}

/** @param {Page} page @returns {Promise<Pose & { distance: number }>} */
const pose = (page) => page.evaluate("({ ...twinray.camera.pose, distance: twinray.camera.distance })").then(any);

/** @param {Page} page @returns {Promise<Values>} */
const values = (page) => page.evaluate("twinray.settings.values").then(any);

/** @param {unknown} x @returns {any} */
const any = (x) => x;

/** @param {Page} page @param {string} id */
const text = (page, id) => page.$eval(`#${id}`, (node) => node.textContent?.trim() ?? "");

/** @param {Page} page @param {string} id */
const visible = (page, id) => page.$eval(`#${id}`, (node) => node.checkVisibility());

/** @type {(a: number[], b: number[]) => number} */
const apart = (a, b) => Math.hypot(...a.map((x, i) => x - b[i]));

/** @param {Page} page @param {[number, number]} from @param {[number, number]} to @param {"left" | "right"} [button] */
async function drag(page, from, to, button = "left") {
    await page.mouse.move(...from);
    await page.mouse.down({ button });
    await page.mouse.move((from[0] + to[0]) / 2, (from[1] + to[1]) / 2);
    await page.mouse.move(...to);
    await page.mouse.up({ button });
}

onPage("within a room one flies, and a drag turns the head so that the scene follows", {}, async (page) => {
    assert.equal((await values(page)).mode, "fly");
    const before = await pose(page);
    await drag(page, [400, 400], [500, 420]);
    const after = await pose(page);
    assert.deepEqual(after.eye, before.eye);
    assert.ok(after.forward[0] < -0.05, "to the left");
    assert.ok(after.forward[1] > 0.01, "and up");
});

onPage("an orbit turns around what is in the middle", {}, async (page) => {
    await page.keyboard.press("o");
    assert.equal((await values(page)).mode, "orbit");
    const before = await pose(page);
    await drag(page, [400, 400], [480, 400]);
    const after = await pose(page);
    /** @type {(p: Pose & { distance: number }) => number[]} */
    const target = (p) => p.eye.map((x, i) => x + p.forward[i] * p.distance);
    assert.ok(apart(target(before), target(after)) < 1e-6);
    assert.ok(apart(before.eye, after.eye) > 0.5);
    assert.ok(Math.abs(before.distance - 5.8) < 1e-6, "the far wall is the depth");
});

onPage("right and shift drags pan: what is under the pointer stays there", {}, async (page) => {
    for (const shift of [false, true]) {
        const seen = await page.evaluate("twinray.renderer.pick(480, 400)").then(any);
        if (shift) await page.keyboard.down("Shift");
        await drag(page, [480, 400], [560, 360], shift ? "left" : "right");
        if (shift) await page.keyboard.up("Shift");
        const now = await page.evaluate("twinray.renderer.pick(560, 360)").then(any);
        assert.ok(apart(seen.point, now.point) < 0.02, `${seen.point} to ${now.point}`);
    }
});

onPage("the wheel comes nearer to what is under the cursor, and never through it", {}, async (page) => {
    const seen = await page.evaluate("twinray.renderer.pick(300, 600)").then(any);
    await page.mouse.move(300, 600);
    await page.mouse.wheel({ deltaY: -100 });
    await wait(50);
    for (let i = 0; i < 8; i++) await page.mouse.wheel({ deltaY: -100 });
    await wait(50);
    const near = await page.evaluate("twinray.renderer.pick(300, 600)").then(any);
    assert.ok(apart(seen.point, near.point) < 0.03, `${seen.point} to ${near.point}`);
    assert.ok(near.distance < 0.5 * seen.distance);
    for (let i = 0; i < 80; i++) await page.mouse.wheel({ deltaY: -300 });
    await wait(50);
    const { eye } = await pose(page);
    assert.ok(apart(eye, seen.point) > 0.005, "still in front of it");
    await page.mouse.wheel({ deltaY: 300 });
    await wait(50);
    assert.ok(apart((await pose(page)).eye, seen.point) > apart(eye, seen.point));
});

onPage("a double click looks at what is there from nearer by", {}, async (page) => {
    const seen = await page.evaluate("twinray.renderer.pick(700, 500)").then(any);
    await page.mouse.click(700, 500, { count: 2 });
    await page.waitForFunction("twinray.camera.distance < 5");
    const now = await pose(page);
    const target = now.eye.map((x, i) => x + now.forward[i] * now.distance);
    assert.ok(apart(target, seen.point) < 1e-6);
});

// A small window, whose frames are quick in software too: what is measured here is time.
onPage("held keys fly, shift flies faster, and then all is at rest", { width: 400, height: 320 }, async (page) => {
    await page.evaluate(`{
        const request = window.requestAnimationFrame;
        window.asked = 0;
        // Seconds of flight: those of frames, of which none counts for more than a tenth.
        const frame = (run) => (time) => {
            const now = performance.now();
            window.flown += Math.min((now - window.last) / 1000, 0.1);
            window.last = now;
            run(time);
        };
        window.requestAnimationFrame = (run) => (window.asked++, request(frame(run)));
        twinray.live.close();
    }`);
    /** How far a key flies, and how fast. @param {string} key @param {boolean} [fast] */
    const flight = async (key, fast = false) => {
        const { eye } = await pose(page);
        await page.evaluate("window.flown = 0; window.last = performance.now();");
        if (fast) await page.keyboard.down("Shift");
        await page.keyboard.down(/** @type {any} */ (key));
        await wait(300);
        // A machine that is busy with other things may not have drawn a frame yet.
        const way = `twinray.camera.pose.eye.map((x, i) => x - [${eye.join()}][i])`;
        await page.waitForFunction(`Math.hypot(...${way}) > 0.12`);
        const [moved, seconds] = /** @type {[number[], number]} */ (await page.evaluate(`[${way}, window.flown]`));
        await page.keyboard.up(/** @type {any} */ (key));
        if (fast) await page.keyboard.up("Shift");
        return { moved, speed: Math.hypot(...moved) / seconds };
    };
    const fly = async (/** @type {string} */ key) => (await flight(key)).moved;
    const ahead = await fly("KeyW");
    assert.ok(ahead[2] < -0.1 && Math.abs(ahead[0]) < 1e-9, String(ahead));
    assert.ok((await fly("KeyS"))[2] > 0.1);
    assert.ok((await fly("KeyD"))[0] > 0.1);
    assert.ok((await fly("KeyE"))[1] > 0.1);
    assert.ok((await fly("ArrowDown"))[2] > 0.1);
    const slow = await flight("KeyA");
    const fast = await flight("KeyA", true);
    assert.ok(slow.moved[0] < -0.1 && fast.moved[0] < -0.1, `${slow.moved}, ${fast.moved}`);
    assert.ok(fast.speed > 2 * slow.speed, `${fast.speed} is faster than ${slow.speed}`);
    await page.keyboard.down("ArrowLeft");
    await page.waitForFunction("twinray.camera.pose.forward[0] < -0.02");
    await page.keyboard.up("ArrowLeft");

    await wait(400);
    const asked = await page.evaluate("window.asked");
    const frames = await page.evaluate("twinray.renderer.frames");
    await wait(600);
    assert.equal(await page.evaluate("window.asked"), asked, "no frame is asked for at rest");
    assert.equal(await page.evaluate("twinray.renderer.frames"), frames, "and none is drawn");
});

onPage("keys in a field or a slider are its own", {}, async (page) => {
    await page.keyboard.press("l");
    await page.focus("#range-high");
    await page.keyboard.type("0wc");
    assert.equal((await values(page)).cells, false);
    const { eye } = await pose(page);
    await page.focus("#fov");
    await page.keyboard.press("ArrowRight");
    const now = await pose(page);
    assert.deepEqual(now.eye, eye);
    assert.ok(Math.abs((now.fov * 180) / Math.PI - 61) < 1e-9);
});

onPage("transitions end at the very camera, and a touch of the mouse ends them", { still: false }, async (page) => {
    await page.keyboard.press("2");
    await page.waitForFunction("twinray.camera.moving");
    await page.waitForFunction("!twinray.camera.moving");
    assert.equal(await page.evaluate("twinray.camera.pose === twinray.walk.cameras[1]"), true);
    assert.equal(await page.$eval("#cameras [aria-current]", (node) => node.textContent), "window");
    await page.keyboard.press("h");
    await page.waitForFunction("twinray.camera.moving");
    await drag(page, [400, 400], [430, 400]);
    assert.equal(await page.evaluate("twinray.camera.moving"), false);
});

onPage("the whole scene is seen from outside", {}, async (page) => {
    await page.keyboard.press("z");
    for (const x of [-4, 4]) {
        for (const y of [-1.5, 1.5]) {
            const [a, b] = any(await page.evaluate(`twinray.camera.project([${x}, ${y}, 3])`));
            assert.ok(Math.abs(a) < 1 && Math.abs(b) < 1, `${a}, ${b}`);
        }
    }
});

onPage("a plan is seen straight down and can be turned", {}, async (page) => {
    await page.keyboard.press("3");
    assert.deepEqual((await pose(page)).forward, [0, -1, 0]);
    await drag(page, [400, 400], [500, 400]);
    const { forward, up } = await pose(page);
    assert.ok(forward[1] < -0.999999 && Math.abs(up[0]) > 0.05);
});

onPage("every setting goes into the address, and a link brings the same picture", {}, async (page) => {
    assert.equal(await page.evaluate("location.hash"), "", "nothing is written before anything changes");
    await drag(page, [400, 400], [470, 380]);
    for (const key of ["l", "c", "k", "o", "t", "+", ">"]) await page.keyboard.press(/** @type {any} */ (key));
    await page.select("#map", "viridis");
    await page.evaluate(() => {
        for (const [id, typed] of [
            ["range-high", "1,200 lx"],
            ["range-low", "50"],
        ]) {
            const field = /** @type {HTMLInputElement} */ (document.getElementById(id));
            field.value = typed;
            field.dispatchEvent(new Event("change"));
        }
    });
    await page.waitForFunction("/range=50,1200.*map=viridis/.test(location.hash)");
    const hash = /** @type {string} */ (await page.evaluate("location.hash"));
    const [was, set] = [await pose(page), await values(page)];
    assert.deepEqual(set.range, [50, 1200]);

    const second = await open(chromium, { hash, still: true });
    const [is, now] = [await pose(second.page), await values(second.page)];
    assert.ok(apart(is.eye, was.eye) < 1e-5 && apart(is.forward, was.forward) < 1e-5);
    assert.ok(Math.abs(is.distance - was.distance) < 1e-5);
    assert.ok(Math.abs((now.exposure ?? 0) - (set.exposure ?? 1)) < 1e-3);
    assert.deepEqual({ ...now, exposure: 0, speed: 0 }, { ...set, exposure: 0, speed: 0 });
    assert.ok(Math.abs(now.speed - set.speed) < 1e-3);
    assert.deepEqual(second.complaints, []);
    await second.page.evaluate("location.hash = '#eye=11,2,-19&forward=0,0,1'");
    await second.page.waitForFunction("twinray.camera.pose.eye[0] === 1");
    assert.equal((await values(second.page)).falseColour, false);
    await second.page.close();
});

onPage("the address is written at most four times a second", {}, async (page) => {
    await page.evaluate(`{
        const replace = history.replaceState.bind(history);
        window.written = 0;
        history.replaceState = (...all) => (window.written++, replace(...all));
    }`);
    await page.mouse.move(300, 400);
    await page.mouse.down();
    const start = Date.now();
    for (let i = 0; i < 60; i++) await page.mouse.move(300 + i, 400 + (i % 7));
    await page.mouse.up();
    await wait(300);
    const written = Number(await page.evaluate("window.written"));
    assert.ok(written >= 1 && written <= (Date.now() - start) / 250 + 1, `${written} times`);
});

onPage(
    "garbage in the address is ignored",
    { hash: "#eye=x&forward=1&range=9,1&tone=%E0%A4%A&fov=-1" },
    async (page) => {
        assert.equal(await page.evaluate("twinray.camera.pose === twinray.walk.cameras[0]"), true);
        assert.equal((await values(page)).range, null);
    },
);

onPage("false colours have a legend; its range can be typed, and nonsense is marked", {}, async (page) => {
    assert.equal(await visible(page, "legend"), false);
    await page.click("#false-colour");
    assert.equal(await text(page, "legend-title"), "Illuminance, lx");
    assert.match(await text(page, "legend-ticks"), /^60.*200.*870$/);
    await page.click("#range-low", { count: 3 });
    await page.keyboard.type("100");
    await page.keyboard.press("Tab");
    assert.deepEqual((await values(page)).range, [100, 870]);
    assert.match(await text(page, "legend-ticks"), /^100/);
    await page.click("#range-high", { count: 3 });
    await page.keyboard.type("7");
    await page.keyboard.press("Tab");
    assert.equal(await page.$eval("#range-high", (node) => node.getAttribute("aria-invalid")), "true");
    assert.deepEqual((await values(page)).range, [100, 870], "the last one that makes sense stays");
    await page.click("#range-auto");
    assert.equal((await values(page)).range, null);
    assert.equal(await page.$eval("#range-low", (node) => /** @type {HTMLInputElement} */ (node).value), "60");
});

onPage("without photometry it is irradiance", { query: "?watt" }, async (page) => {
    await page.keyboard.press("l");
    assert.equal(await text(page, "legend-title"), "Irradiance, W/m²");
    assert.equal(await text(page, "h-illuminance"), "Irradiance");
});

onPage("a click reads the light, says so, and its mark stays on its point", {}, async (page) => {
    await page.click("#pick");
    await page.mouse.click(420, 560);
    await page.waitForSelector("#reading:not([hidden])");
    assert.match(await text(page, "reading-value"), /^\d+ lx$/);
    assert.equal(await text(page, "reading-error"), "± 2.1 %");
    assert.equal(await text(page, "reading-material"), "oak, oiled");
    assert.match(await text(page, "reading-position"), /^9\.\d{3}, \d\.\d{3}, −20\.600$/, "scene coordinates");
    await page.waitForFunction("/^Reading 1: .* oak, oiled$/.test(document.querySelector('#announcer').textContent)");
    const at = await page.$eval("#markers button", (node) => {
        const box = node.getBoundingClientRect();
        return [box.x + 7, box.y + box.height / 2];
    });
    assert.ok(apart(at, [420, 560]) < 1, String(at));
    await drag(page, [300, 300], [360, 300]);
    const { x, y } = await page.$eval("#markers button", (node) => {
        const box = node.getBoundingClientRect();
        return { x: box.x + 7, y: box.y + box.height / 2 };
    });
    const [seen, kept] = await Promise.all([
        page.evaluate(`twinray.renderer.pick(${x}, ${y})`).then(any),
        page.evaluate("twinray.readings.table()").then(any),
    ]);
    assert.equal(seen.material, "oak, oiled");
    assert.equal(kept.split("\n").length, 2);
    // By keyboard: the middle of the picture.
    await page.focus("#view");
    await page.keyboard.press("Enter");
    await page.waitForFunction("document.querySelectorAll('#markers button').length === 2");
    await page.keyboard.press("Escape");
    assert.equal((await values(page)).picking, false);
    await page.keyboard.press("Escape");
    await page.keyboard.press("Escape");
    assert.equal(await visible(page, "reading"), false);
});

onPage("at the right edge a mark has its words on the left", {}, async (page) => {
    await page.evaluate("twinray.readings.take(950, 500)");
    const { left, right } = await page.$eval("#markers button", (node) => {
        const { left, right } = node.getBoundingClientRect();
        return { left, right };
    });
    assert.ok(Math.abs(right - 957) < 1 && left < 930, `${left} to ${right}`);
});

onPage("readings follow the light", {}, async (page) => {
    await page.evaluate("twinray.readings.take(420, 560)");
    const before = await text(page, "reading-value");
    await page.evaluate(`{
        const { renderer, readings } = twinray;
        const pick = renderer.pick.bind(renderer);
        renderer.pick = async (x, y) => ({ ...(await pick(x, y)), illuminance: 1234 });
        readings.refresh();
    }`);
    await page.waitForFunction("document.querySelector('#reading-value').textContent === '1,230 lx'");
    assert.notEqual(before, "1,230 lx");
    assert.equal(await page.$eval("#markers button", (node) => node.textContent), "1,230 lx");
});

onPage("a mark behind something is dimmed", {}, async (page) => {
    await page.keyboard.press("r");
    await page.mouse.click(520, 560);
    await page.waitForSelector("#reading:not([hidden])");
    await page.keyboard.press("r");
    await page.evaluate(
        "twinray.camera.set({ ...twinray.camera.pose, eye: [-3, -1, 1], forward: [Math.SQRT1_2, 0, -Math.SQRT1_2] })",
    );
    await page.waitForSelector("#markers [data-behind='true']");
});

onPage("the solve is shown, paused, resumed, finished and lost", {}, async (page) => {
    assert.equal(await text(page, "solve-state"), "Solving");
    assert.match(await text(page, "solve-message"), /^About \d+ s to an error of 2 %$/);
    const share = Number(await page.$eval("#solve-bar", (node) => node.getAttribute("aria-valuenow")));
    assert.ok(share > 10 && share < 90);
    await page.keyboard.press("Space");
    assert.equal(await text(page, "solve-state"), "Paused");
    assert.equal(await text(page, "solve-toggle"), "Resume");
    await page.click("#solve-toggle");
    assert.equal(await text(page, "solve-state"), "Solving");
    await page.evaluate("standinLive.tell({ state: 'lost', message: 'The server has ended.' })");
    assert.equal(await text(page, "solve-state"), "Connection lost");
    await page.waitForFunction("document.querySelector('#announcer').textContent.includes('The server has ended')");
    assert.equal(await visible(page, "solve-toggle"), false);
    await page.evaluate("standinLive.tell({ state: 'finished', message: undefined, error: 0.02 })");
    assert.equal(await text(page, "solve-state"), "Finished");
    assert.equal(await page.$eval("#solve-bar", (node) => node.getAttribute("aria-valuenow")), "100");
});

onPage("an exported page needs no server and says what its light was made with", { query: "?export" }, async (page) => {
    assert.equal(await text(page, "solve-state"), "Solved");
    assert.equal(await text(page, "solve-rays"), "5 M");
    assert.equal(await visible(page, "solve-toggle"), false);
    assert.equal(
        await page.evaluate("performance.getEntriesByType('resource').filter((e) => /^http/.test(e.name)).length"),
        0,
    );
});

test("an exported page works from a file", async () => {
    const folder = mkdtempSync(join(tmpdir(), "walk-"));
    const file = join(folder, "walk.html");
    writeFileSync(file, page(true));
    const { page: tab, complaints } = await open({ ...chromium, url: `file://${file}` }, { still: true });
    await drag(tab, [400, 400], [500, 420]);
    await tab.keyboard.press("l");
    await tab.waitForFunction("location.hash.includes('false-colour=1')");
    await tab.reload();
    await tab.waitForFunction("window.twinray");
    assert.equal(await visible(tab, "legend"), true);
    assert.deepEqual(complaints, []);
    await tab.close();
    rmSync(folder, { recursive: true });
});

onPage("help lists the keys, and closes by key and button", {}, async (page) => {
    await page.keyboard.press("?");
    assert.equal(await page.$eval("#help", (node) => /** @type {HTMLDialogElement} */ (node).open), true);
    const keys = await page.$$eval("#help-body kbd", (nodes) => nodes.map((node) => node.textContent));
    for (const key of ["W", "H", "O", "X", "T", "G", "L", "K", "C", "R", "U", "F", "P", "?", "Space", "Esc"]) {
        assert.ok(keys.includes(key), key);
    }
    await page.keyboard.press("c");
    assert.equal((await values(page)).cells, false, "keys do nothing behind it");
    await page.keyboard.press("Escape");
    assert.equal(await page.$eval("#help", (node) => /** @type {HTMLDialogElement} */ (node).open), false);
    await page.click("#tool-help");
    await page.click("#help-close");
    assert.equal(await page.$eval("#help", (node) => /** @type {HTMLDialogElement} */ (node).open), false);
});

onPage("exposure follows the picture until it is set", {}, async (page) => {
    await page.waitForFunction("document.querySelector('#exposure-value').textContent === '−7.4 EV'");
    await page.keyboard.press("+");
    assert.ok(Math.abs(((await values(page)).exposure ?? 0) + 7) < 1e-3);
    assert.equal(await page.$eval("#exposure-auto", (node) => /** @type {HTMLInputElement} */ (node).checked), false);
    await page.click("#exposure-auto");
    assert.equal((await values(page)).exposure, null);
});

onPage(
    "the picture is saved under the scene's name, with the legend on it",
    { query: "?name=Hall:%20east" },
    async (page) => {
        await page.evaluate(`{
        window.saved = [];
        HTMLAnchorElement.prototype.click = function () {
            const image = new Image();
            image.src = this.href;
            window.saved.push(image.decode().then(() => [this.download, image.naturalWidth]));
        };
    }`);
        await page.keyboard.press("l");
        await page.keyboard.press("g");
        await page.waitForFunction("window.saved.length === 1");
        const [name, width] = any(await page.evaluate("window.saved[0]"));
        assert.equal(name, "Hall- east.png");
        assert.equal(width, 968);
    },
);

onPage("the panel goes away and comes back, and the picture takes its place", {}, async (page) => {
    await page.keyboard.press("p");
    assert.equal(await visible(page, "panel"), false);
    await page.waitForFunction("document.querySelector('canvas').width === 1280");
    await page.click("#tool-panel");
    await page.waitForFunction("document.querySelector('canvas').width === 968");
});

onPage(
    "one finger turns, two pan and pinch, a double tap focuses",
    { width: 360, height: 640, touch: true },
    async (page) => {
        const client = await page.createCDPSession();
        /** @type {(type: "touchStart" | "touchMove" | "touchEnd", points: [number, number][]) => Promise<void>} */
        const touch = async (type, points) => {
            const touchPoints = points.map(([x, y], id) => ({ x, y, id }));
            await client.send("Input.dispatchTouchEvent", { type, touchPoints });
        };
        const start = await pose(page);
        await touch("touchStart", [[100, 300]]);
        await touch("touchMove", [[130, 300]]);
        await touch("touchMove", [[160, 300]]);
        await touch("touchEnd", []);
        const turned = await pose(page);
        assert.deepEqual(turned.eye, start.eye);
        assert.ok(turned.forward[0] < -0.05);

        await touch("touchStart", [
            [150, 300],
            [210, 300],
        ]);
        for (let i = 1; i <= 6; i++)
            await touch("touchMove", [
                [150 - 10 * i, 300],
                [210 + 10 * i, 300],
            ]);
        await touch("touchEnd", []);
        const near = await pose(page);
        assert.ok(Math.abs(near.distance / turned.distance - 1 / 3) < 0.02, `${near.distance} of ${turned.distance}`);
        assert.deepEqual(near.forward, turned.forward);

        await page.evaluate("twinray.camera.set(twinray.walk.cameras[0], 5)");
        await page.touchscreen.tap(250, 320);
        await page.touchscreen.tap(250, 320);
        await page.waitForFunction("Math.abs(twinray.camera.pose.forward[0]) > 0.05");
    },
);

for (const [width, height] of [
    [360, 640],
    [320, 568],
    [640, 360],
    [1280, 800],
    [2560, 1440],
]) {
    onPage(`nothing sticks out at ${width} by ${height}`, { width, height, touch: width < 700 }, async (page) => {
        mkdirSync(new URL("pictures", import.meta.url), { recursive: true });
        /** @param {string} state */
        const check = async (state) => {
            await page.screenshot({ path: new URL(`pictures/${width}-${state}.png`, import.meta.url).pathname });
            const wide = await page.evaluate(() => [
                document.documentElement.scrollWidth,
                ...[...document.querySelectorAll("#panel, #panel-body, #stage, dialog[open]")].map((node) =>
                    node.scrollWidth - node.clientWidth > 1 ? `${node.id} ${node.scrollWidth}` : 0,
                ),
            ]);
            assert.deepEqual(wide.filter(Boolean), [width], state);
            const outside = await page.evaluate(() =>
                [...document.querySelectorAll("button, input, select, .card, figure")]
                    .filter((node) => node.checkVisibility() && !node.closest("#markers"))
                    .filter((node) => {
                        const { left, right } = node.getBoundingClientRect();
                        return left < -0.5 || right > innerWidth + 0.5;
                    })
                    .map((node) => node.id || node.className),
            );
            assert.deepEqual(outside, [], state);
        };
        await check("closed");
        await page.keyboard.press("l");
        await page.keyboard.press("r");
        await page.evaluate("twinray.readings.take(120, 150)");
        await check("reading");
        if (await visible(page, "sheet-toggle")) await page.tap("#sheet-toggle");
        else if (!(await visible(page, "panel"))) await page.tap("#tool-panel");
        assert.equal(await visible(page, "curve"), true);
        await check("open");
        await page.click("#tool-help");
        await check("help");
    });
}

onPage("all controls have a name, and all are reached by Tab", {}, async (page) => {
    await page.keyboard.press("l");
    const nameless = await page.evaluate(() =>
        [...document.querySelectorAll("button, input, select, canvas[tabindex]")]
            .filter((node) => node.checkVisibility())
            .filter((node) => {
                const labels = /** @type {HTMLInputElement} */ (node).labels;
                return !(
                    node.getAttribute("aria-label") ||
                    node.textContent?.trim() ||
                    labels?.[0]?.textContent?.trim()
                );
            })
            .map((node) => node.id),
    );
    assert.deepEqual(nameless, []);
    /** @type {Set<string>} */
    const reached = new Set();
    await page.focus("#view");
    for (let i = 0; i < 45; i++) {
        reached.add(String(await page.evaluate("document.activeElement.id || document.activeElement.name")));
        await page.keyboard.press("Tab");
    }
    for (const id of [
        "view",
        "tool-pick",
        "tool-panel",
        "solve-toggle",
        "mode",
        "fov",
        "exposure",
        "curve",
        "range-low",
        "scale",
        "cells",
        "pick",
    ]) {
        assert.ok(reached.has(id), `${id} of ${[...reached]}`);
    }
});

onPage("text stands out from its ground as WCAG AA asks", {}, async (page) => {
    await page.keyboard.press("l");
    const weak = await page.evaluate(() => {
        /** @param {string} colour */
        const parse = (colour) => (colour.match(/[\d.]+/g) ?? []).map(Number);
        /** @param {number[]} rgb */
        const luminance = (rgb) => {
            const [r, g, b] = rgb.map((x) =>
                x / 255 <= 0.04045 ? x / 255 / 12.92 : ((x / 255 + 0.055) / 1.055) ** 2.4,
            );
            return 0.2126 * r + 0.7152 * g + 0.0722 * b;
        };
        return [...document.querySelectorAll("#panel *, #legend *, #tools button")]
            .filter(
                (node) =>
                    node.checkVisibility() && [...node.childNodes].some((n) => n.nodeType === 3 && n.nodeValue?.trim()),
            )
            .map((node) => {
                const text = parse(getComputedStyle(node).color);
                // What is under glass may be as white as paper.
                let ground = [255, 255, 255];
                const grounds = [];
                for (let at = /** @type {Element | null} */ (node); at; at = at.parentElement) {
                    grounds.unshift(parse(getComputedStyle(at).backgroundColor));
                }
                if (node.closest("#stage")) grounds.splice(0, 3);
                for (const [r, g, b, a = 1] of grounds) ground = ground.map((x, i) => x * (1 - a) + [r, g, b][i] * a);
                const [high, low] = [luminance(text), luminance(ground)].sort((a, b) => b - a);
                return { what: `${node.id} ${node.textContent?.slice(0, 20)}`, contrast: (high + 0.05) / (low + 0.05) };
            })
            .filter(({ contrast }) => contrast < 4.5);
    });
    assert.deepEqual(weak, []);
});

test("a scene that cannot be loaded is said to be so", async () => {
    const { page } = await open(chromium, { query: "?fail" });
    assert.match(await text(page, "cover-text"), /could not be loaded/);
    assert.equal(await visible(page, "panel"), false);
    assert.equal(await visible(page, "cover-reload"), true);
    await page.close();
});
