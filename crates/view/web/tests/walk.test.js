/**
 * The whole walk: `twinray view` and exported files in a browser, their pictures against those of `twinray render`. `TWINRAY`
 * names the command.
 */

import assert from "node:assert/strict";
import { execFileSync, spawn } from "node:child_process";
import { existsSync, mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { request } from "node:http";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { after, before, test } from "node:test";
import { fileURLToPath, pathToFileURL } from "node:url";

import { browser as start, wait } from "./browser.js";
import { panesFile, throughPanes, wall } from "./panes.js";

/** @import { Browser, Page } from "puppeteer-core" */
/** @import { ChildProcess } from "node:child_process" */

const COMMAND = process.env.TWINRAY ?? "";
const skip = existsSync(COMMAND) ? false : "TWINRAY names no command";
/** Where pictures are kept to be looked at. */
const PICTURES = join(dirname(fileURLToPath(import.meta.url)), "pictures");
/** How far the mean of a diffuse scene may be from that of `render`. */
const MEAN = 0.03;
/** A window for pictures whose size does not matter; the panel still stands beside the view. */
const SMALL = { width: 768, height: 240 };
const TOKEN = "0123456789abcdefghij";

/** @type {Browser} */
let browser;
/** @type {string} */
let folder;
/** @type {Set<ChildProcess>} */
const servers = new Set();
before(async () => {
    if (skip) return;
    mkdirSync(PICTURES, { recursive: true });
    folder = mkdtempSync(join(tmpdir(), "twinray-walk-"));
    browser = await start();
});
after(async () => {
    servers.forEach((server) => server.kill("SIGKILL"));
    await browser?.close();
    if (folder) rmSync(folder, { recursive: true });
});

/** @param {string[]} args */
const run = (...args) =>
    execFileSync(COMMAND, [...args, "--quiet"], { cwd: folder, stdio: ["ignore", "pipe", "pipe"] });

/**
 * Starts `twinray view` and waits for its address.
 * @param {string[]} args
 * @returns {Promise<{url: string, server: ChildProcess}>}
 */
async function view(...args) {
    const server = spawn(COMMAND, ["view", ...args, "--quiet"], { cwd: folder, stdio: ["ignore", "pipe", "inherit"] });
    servers.add(server);
    server.on("exit", () => servers.delete(server));
    const url = await new Promise((done, fail) => {
        let text = "";
        server.stdout.on("data", (/** @type {Buffer} */ data) => {
            text += data;
            if (text.includes("\n")) done(text.trim());
        });
        server.on("exit", (code) => fail(new Error(`twinray view ended with ${code}`)));
    });
    return { url, server };
}

/**
 * A page and what it complained of. Requests go to `url` or nowhere.
 * @param {string} url
 * @param {{width?: number, height?: number}} [size]
 */
async function open(url, { width = 800, height = 480 } = {}) {
    const page = await browser.newPage();
    /** @type {string[]} */
    const complaints = [];
    page.on("console", (message) => {
        // Software drivers call reading a pixel slow.
        if (["error", "warn"].includes(message.type()) && !message.text().includes("GL Driver Message"))
            complaints.push(message.text());
    });
    page.on("pageerror", (error) => complaints.push(String(error)));
    page.on("request", (r) => {
        if (!/^(data|blob):/.test(r.url()) && !r.url().startsWith(url.replace(/#.*/, "")))
            complaints.push(`asks for ${r.url()}`);
    });
    await page.setViewport({ width, height });
    await page.emulateMediaFeatures([{ name: "prefers-reduced-motion", value: "reduce" }]);
    await page.goto(url);
    await page.waitForFunction("window.twinray?.renderer.state.frames > 0", { timeout: 60_000 });
    return { page, complaints };
}

/** Until the view rests. @param {Page} page */
const rested = (page) =>
    page.waitForFunction("window.twinray.renderer.state.resting && window.twinray.renderer.state.frames > 7", {
        timeout: 120_000,
    });

/** Until the solver has finished and the page has its last light. @param {Page} page */
const finished = (page) =>
    page.waitForFunction(
        "document.querySelector('#solve-state').textContent.includes('Finished') && window.twinray.renderer.state.isFinal",
        { timeout: 120_000 },
    );

/**
 * The page's picture as the shader makes it, without panels, and its size.
 * @param {Page} page
 * @param {Record<string, unknown>} options
 * @param {string} name
 */
async function picture(page, options, name) {
    const size = await page.evaluate((o) => {
        const { renderer } = /** @type {any} */ (globalThis).twinray;
        renderer.setOptions(o);
        return [renderer.canvas.width, renderer.canvas.height];
    }, options);
    await rested(page);
    const base64 = await page.evaluate(async () => {
        const { renderer } = /** @type {any} */ (globalThis).twinray;
        const bytes = new Uint8Array(await (await renderer.screenshot()).arrayBuffer());
        return btoa(Array.from(bytes, (b) => String.fromCharCode(b)).join(""));
    });
    writeFileSync(join(PICTURES, `${name}.png`), Buffer.from(base64, "base64"));
    return { size: size.join("x"), base64 };
}

/**
 * Means of two PNG files' linear channels where neither is at its end, and their RMS difference over the mean.
 * @param {string} a base64
 * @param {string} b base64
 * @returns {Promise<{ratio: number[], rms: number}>}
 */
async function compared(a, b) {
    const page = await browser.newPage();
    try {
        return await page.evaluate(
            async (files) => {
                const [x, y] = await Promise.all(
                    files.map(async (file) => {
                        const bytes = Uint8Array.from(atob(file), (c) => c.charCodeAt(0));
                        const bitmap = await createImageBitmap(new Blob([bytes], { type: "image/png" }), {
                            colorSpaceConversion: "none",
                        });
                        const canvas = new OffscreenCanvas(bitmap.width, bitmap.height);
                        const context = /** @type {OffscreenCanvasRenderingContext2D} */ (canvas.getContext("2d"));
                        context.drawImage(bitmap, 0, 0);
                        return context.getImageData(0, 0, bitmap.width, bitmap.height).data;
                    }),
                );
                if (x.length !== y.length) throw new Error(`pictures of ${x.length / 4} and ${y.length / 4} pixels`);
                const linear = (/** @type {number} */ c) =>
                    c <= 0.04045 * 255 ? c / 255 / 12.92 : ((c / 255 + 0.055) / 1.055) ** 2.4;
                const sums = [
                    [0, 0, 0],
                    [0, 0, 0],
                ];
                let [square, all] = [0, 0];
                for (let i = 0; i < x.length; i += 4) {
                    if (Math.max(x[i], x[i + 1], x[i + 2], y[i], y[i + 1], y[i + 2]) > 250) continue;
                    for (let k = 0; k < 3; k++) {
                        const [p, q] = [linear(x[i + k]), linear(y[i + k])];
                        sums[0][k] += p;
                        sums[1][k] += q;
                        square += (p - q) ** 2;
                        all += 1;
                    }
                }
                const mean = (sums[1][0] + sums[1][1] + sums[1][2]) / all;
                return { ratio: sums[0].map((s, k) => s / sums[1][k]), rms: Math.sqrt(square / all) / mean };
            },
            [a, b],
        );
    } finally {
        await page.close();
    }
}

test("a scene is lit while it is solved, can be paused, and ends as `render` shows it", { skip }, async () => {
    const { url, server } = await view("cornell", "--patches", "10k", "--rays", "12M", "--token", TOKEN);
    const { page, complaints } = await open(url);
    /** @type {() => Promise<any>} */
    const status = () => page.evaluate(async () => (await fetch("status")).json());
    const early = await status();
    assert.ok(["solving", "finished"].includes(early.state), early.state);
    await page.evaluate("window.twinray.live.pause()");
    await wait(700);
    const paused = await status();
    if (paused.state !== "finished") {
        assert.equal(paused.state, "paused");
        await wait(500);
        assert.equal((await status()).rays, paused.rays, "a paused solver shoots nothing");
        await page.evaluate("window.twinray.live.resume()");
    }
    await finished(page);
    assert.ok((await status()).rays >= 12e6);

    const { size, base64 } = await picture(page, { exposure: 2, curve: "none" }, "cornell");
    server.kill("SIGINT");
    run("solve", "cornell", "--patches", "10k", "--rays", "12M", "-o", "cornell.twin");
    const how = ["--method", "patches", "--exposure", "2", "--tone", "none", "--size", size];
    run("render", "cornell.twin", ...how, "-o", "cornell.png");
    const { ratio, rms } = await compared(base64, readFileSync(join(folder, "cornell.png"), "base64"));
    assert.ok(
        ratio.every((r) => Math.abs(r - 1) < MEAN),
        `means differ by ${ratio}`,
    );
    assert.ok(rms < 0.08, `pictures differ by ${rms}`);
    // The server is gone, which is no error of the page's own.
    assert.deepEqual(
        complaints.filter((c) => !c.includes("ERR_CONNECTION_REFUSED")),
        [],
    );
    await page.close();
});

test("a point says its illuminance, which is that of the solution", { skip }, async () => {
    run("solve", "plates", "--rays", "4M", "-o", "plates.twin");
    const { url, server } = await view("plates.twin");
    const { page, complaints } = await open(url);
    await finished(page);
    await rested(page);
    const size = /** @type {number[]} */ (
        await page.evaluate(
            "[document.querySelector('canvas').clientWidth, document.querySelector('canvas').clientHeight]",
        )
    );
    const found = [];
    for (let i = 1; i < 8; i++) {
        for (let j = 1; j < 8; j++) {
            const at = [(size[0] * i) / 8, (size[1] * j) / 8];
            const pick = await page.evaluate(
                async ([x, y]) => /** @type {any} */ (globalThis).twinray.renderer.pick(x, y),
                at,
            );
            if (pick) found.push(pick);
        }
    }
    assert.ok(found.length > 3, "the scene is in the picture");
    run("export", "plates.twin", "-o", "plates.csv");
    const lines = readFileSync(join(folder, "plates.csv"), "utf8").trim().split("\n");
    const names = lines[0].split(",");
    const column = (/** @type {string} */ name) => names.findIndex((n) => n === name);
    const [x, y, z] = ["x", "y", "z"].map((axis) => names.findIndex((n) => n.endsWith(`_${axis}`) || n === axis));
    const e = ["r", "g", "b"].map((c) => column(`irradiance_${c}`));
    assert.ok(
        [x, y, z, ...e].every((k) => k >= 0),
        lines[0],
    );
    const centre = /** @type {number[]} */ (await page.evaluate("window.twinray.walk.centre"));
    const cells = lines.slice(1).map((line) => line.split(",").map(Number));
    for (const pick of found) {
        const point = pick.point.map((/** @type {number} */ c, /** @type {number} */ k) => c + centre[k]);
        const far = (/** @type {number[]} */ cell) =>
            Math.hypot(cell[x] - point[0], cell[y] - point[1], cell[z] - point[2]);
        const cell = cells.reduce((a, b) => (far(b) < far(a) ? b : a));
        const expected = 0.2126 * cell[e[0]] + 0.7152 * cell[e[1]] + 0.0722 * cell[e[2]];
        // The page is smooth between cells, whose own light is noisy.
        const room = (0.05 + 5 * (pick.error || 0)) * expected + 1e-6;
        assert.ok(Math.abs(pick.illuminance - expected) < room, `${pick.illuminance}, the cell has ${expected}`);
        if (expected > 0) assert.ok(pick.error > 0 && pick.error < 1, `its error is ${pick.error}`);
    }
    assert.deepEqual(complaints, []);
    server.kill("SIGINT");
    await page.close();
});

test("a killed server leaves the light, and a restarted one is found again", { skip }, async () => {
    const args = ["cornell", "--rays", "1M", "--token", TOKEN];
    const first = await view(...args, "--patches", "4k");
    const port = new URL(first.url).port;
    const { page } = await open(first.url);
    await finished(page);
    first.server.kill("SIGKILL");
    const state = "document.querySelector('#solve-state').textContent";
    await page.waitForFunction(`!${state}.includes('Finished')`, { timeout: 20_000 });
    assert.match(String(await page.evaluate(state)), /lost/i);
    // Its frames may just have begun anew, with the last light or another exposure: the page goes on drawing what it has.
    await rested(page);
    const centre = await page.evaluate("window.twinray.renderer.pick(400, 240)");
    assert.ok(/** @type {any} */ (centre)?.illuminance > 0, "the light stays");
    const second = await view(...args, "--patches", "4k", "--port", port);
    assert.equal(second.url, first.url);
    await page.waitForFunction(`${state}.includes('Finished')`, { timeout: 30_000 });
    // Other cells are another scene to a page, which begins anew.
    second.server.kill("SIGKILL");
    await new Promise((done) => second.server.on("exit", done));
    const third = await view(...args, "--port", port, "--patches", "6k");
    await page.waitForFunction("window.twinray?.walk.stats.cells > 5000", { timeout: 30_000 });
    await finished(page);
    third.server.kill("SIGINT");
    await page.close();
});

test("the server answers its own page alone", { skip }, async () => {
    const { url, server } = await view("plates", "--rays", "100k");
    const { port, pathname } = new URL(url);
    const ask = (/** @type {string} */ path, headers = {}, method = "GET") =>
        new Promise((done, fail) => {
            const asked = request({ host: "127.0.0.1", port, path, method, headers }, (answer) => {
                answer.resume();
                done(answer.statusCode);
            });
            asked.on("error", fail);
            asked.end();
        });
    assert.equal(await ask(pathname), 200);
    assert.equal(await ask(`${pathname}scene`), 200);
    assert.equal(await ask("/"), 403, "without the token");
    assert.equal(await ask(`/${"0".repeat(32)}/`), 403, "with another token");
    assert.equal(await ask(pathname, { host: `elsewhere.example:${port}` }), 403, "by another name");
    assert.equal(await ask(`${pathname}pause`, { origin: "http://elsewhere.example" }, "POST"), 403, "from elsewhere");
    assert.equal(await ask(`${pathname}status`, { "sec-fetch-site": "cross-site" }), 403, "from another site");
    assert.equal(await ask(`${pathname}../Cargo.toml`), 404, "no files of the disk");
    assert.equal(await ask(`${pathname}pause`), 404, "nothing changes by looking");
    server.kill("SIGINT");
});

test("an exported file opens from the disk, shows what `render` shows, and rests", { skip }, async () => {
    run("solve", "hall-diffuse", "--patches", "20k", "--rays", "6M", "-o", "hall.twin");
    run("export", "hall.twin", "-o", "hall.html");
    const { page, complaints } = await open(pathToFileURL(join(folder, "hall.html")).href);
    const { size, base64 } = await picture(page, { exposure: -6, curve: "none" }, "hall");
    const how = ["--method", "patches", "--exposure=-6", "--tone", "none", "--size", size];
    run("render", "hall.twin", ...how, "-o", "hall.png");
    const { ratio, rms } = await compared(base64, readFileSync(join(folder, "hall.png"), "base64"));
    assert.ok(
        ratio.every((r) => Math.abs(r - 1) < MEAN),
        `means differ by ${ratio}`,
    );
    assert.ok(rms < 0.15, `pictures differ by ${rms}`);

    // Nothing runs while nothing moves; a step of the camera draws again.
    await page.evaluate(() => {
        const global = /** @type {any} */ (globalThis);
        const asked = global.requestAnimationFrame.bind(global);
        global.asked = 0;
        global.requestAnimationFrame = (/** @type {FrameRequestCallback} */ f) => {
            global.asked += 1;
            return asked(f);
        };
    });
    await wait(1500);
    assert.equal(await page.evaluate("globalThis.asked"), 0, "a resting page draws nothing");
    const before = await page.evaluate("JSON.stringify(window.twinray.camera.pose.eye)");
    await page.evaluate("document.querySelector('canvas').focus()");
    await page.keyboard.down("w");
    await wait(1200);
    await page.keyboard.up("w");
    await rested(page);
    assert.notEqual(await page.evaluate("JSON.stringify(window.twinray.camera.pose.eye)"), before, "W walks");
    await page.screenshot({ path: join(PICTURES, "hall-page.png") });
    assert.deepEqual(complaints, []);
    await page.close();
});

test("a glossy hall is as bright as `render` has it, and false colours fit a small screen", { skip }, async () => {
    run("solve", "hall", "--patches", "20k", "--rays", "4M", "-o", "glossy.twin");
    run("export", "glossy.twin", "-o", "glossy.html");
    const screen = { width: 360, height: 640 };
    const { page, complaints } = await open(pathToFileURL(join(folder, "glossy.html")).href, screen);
    const { size, base64 } = await picture(page, { exposure: -6, curve: "none" }, "glossy");
    const how = ["--method", "gather", "--spp", "8", "--exposure=-6", "--tone", "none", "--size", size];
    // The page shows the width of the camera's picture in an upright window.
    const fov = await page.evaluate("(window.twinray.camera.view.fov * 180) / Math.PI");
    run("render", "glossy.twin", ...how, "--fov", String(fov), "-o", "glossy.png");
    const { ratio } = await compared(base64, readFileSync(join(folder, "glossy.png"), "base64"));
    // Harmonics blur what floors reflect: their mean is right, and no bound is known for a view.
    assert.ok(
        ratio.every((r) => Math.abs(r - 1) < 0.06),
        `means differ by ${ratio}`,
    );
    await page.keyboard.press("l");
    await rested(page);
    await page.screenshot({ path: join(PICTURES, "false-colour.png") });
    assert.ok(await page.evaluate("document.documentElement.scrollWidth <= innerWidth"), "nothing is too wide");
    assert.deepEqual(complaints, []);
    await page.close();
});

test("panes behind panes are as bright and as coloured from either side as by hand", { skip }, async () => {
    writeFileSync(join(folder, "panes.gltf"), panesFile());
    run("solve", "panes.gltf", "--patches", "2k", "--rays", "20k", "-o", "panes.twin");
    run("export", "panes.twin", "-o", "panes.html");
    const { page, complaints } = await open(pathToFileURL(join(folder, "panes.html")).href, SMALL);
    for (const camera of ["front", "back"]) {
        await page.evaluate((name) => {
            const { camera, walk } = /** @type {any} */ (globalThis).twinray;
            camera.set(walk.cameras.find((/** @type {any} */ c) => c.name === name));
        }, camera);
        const { size, base64 } = await picture(page, { exposure: 0, curve: "none" }, `panes-${camera}`);
        const [middle, beside] = /** @type {number[][]} */ (
            await page.evaluate(async () => {
                const { renderer } = /** @type {any} */ (globalThis).twinray;
                const { clientWidth: width, clientHeight: height } = renderer.canvas;
                const places = [0.5, 0.02].map((y) => renderer.pick(0.5 * width, y * height));
                return (await Promise.all(places)).map((pick) => pick.radiance);
            })
        );
        for (const [found, expected] of [
            [middle, throughPanes(camera)],
            [beside, wall(camera)],
        ]) {
            const far = found.map((x, k) => Math.abs(x / expected[k] - 1));
            // Half floats have eleven bits.
            assert.ok(Math.max(...far) < 0.003, `${camera}: ${found}, by hand ${expected}`);
        }
        const how = ["--method", "gather", "--spp", "4", "--exposure", "0", "--tone", "none"];
        run("render", "panes.twin", ...how, "--camera", camera, "--size", size, "-o", "panes.png");
        const { ratio } = await compared(base64, readFileSync(join(folder, "panes.png"), "base64"));
        assert.ok(
            ratio.every((r) => Math.abs(r - 1) < MEAN),
            `${camera}: means differ by ${ratio}`,
        );
    }
    assert.deepEqual(complaints, []);
    await page.close();
});

/** A page of the panes, from the disk. @param {string} [hash] */
async function openPanes(hash = "") {
    const file = join(folder, "window.html");
    if (!existsSync(file)) {
        writeFileSync(join(folder, "window.gltf"), panesFile());
        run("solve", "window.gltf", "--patches", "2k", "--rays", "20k", "-o", "window.twin");
        run("export", "window.twin", "-o", "window.html");
    }
    return open(pathToFileURL(file).href + hash, SMALL);
}

/**
 * What the middle of the picture shows, once the view rests. It is looked at in the very step that finds the view at rest:
 * what was asked of the page before, such as another size, may reach it only with its next frames and begin the picture anew.
 * @param {Page} page
 * @returns {Promise<number[]>}
 */
async function middle(page) {
    return /** @type {any} */ (
        await page.evaluate(async () => {
            const { renderer } = /** @type {any} */ (globalThis).twinray;
            const frame = () => new Promise((done) => requestAnimationFrame(done));
            for (let k = 0; k < 3 || !renderer.state.resting || renderer.state.frames < 8; k++) await frame();
            const { clientWidth: width, clientHeight: height } = renderer.canvas;
            return (await renderer.pick(width / 2, height / 2)).radiance;
        })
    );
}

/** @param {number[]} found @param {number[]} expected */
const isSeen = (found, expected) =>
    assert.ok(
        found.every((x, k) => Math.abs(x / expected[k] - 1) < 0.003),
        `${found}, by hand ${expected}`,
    );

test("a lost graphics processor is told, and the same view comes back with it", { skip }, async () => {
    const { page, complaints } = await openPanes();
    await page.evaluate(() => {
        const { camera, walk } = /** @type {any} */ (globalThis).twinray;
        camera.set(walk.cameras[1]);
    });
    isSeen(await middle(page), throughPanes("back"));
    const pose = "JSON.stringify(window.twinray.camera.pose.eye.map((x) => Math.round(1e3 * x)))";
    const before = await page.evaluate(pose);
    // Lost in the midst of a movement: its last step is what has to come back.
    const found = await page.evaluate(async () => {
        const global = /** @type {any} */ (globalThis);
        const { renderer, camera } = global.twinray;
        global.context = renderer.gl.getExtension("WEBGL_lose_context");
        global.context.loseContext();
        await new Promise((done) => renderer.canvas.addEventListener("webglcontextlost", done, { once: true }));
        camera.move([0.25, 0, 0]);
        renderer.resize();
        camera.move([-0.25, 0, 0]);
        await new Promise((done) => setTimeout(done, 300));
        const refused = await renderer.screenshot().then(
            () => false,
            () => true,
        );
        return { pick: await renderer.pick(9, 9), refused, resting: renderer.state.resting };
    });
    assert.deepEqual(found, { pick: null, refused: true, resting: true });
    assert.match(String(await page.$eval("#toast", (note) => note.textContent)), /comes back/);
    await Promise.all([page.waitForNavigation(), page.evaluate("globalThis.context.restoreContext()")]);
    await page.waitForFunction("window.twinray?.renderer.state.frames > 0", { timeout: 60_000 });
    assert.equal(await page.evaluate(pose), before);
    isSeen(await middle(page), throughPanes("back"));
    // Chromium itself may say that a context was lost.
    assert.deepEqual(
        complaints.filter((c) => !/CONTEXT_LOST|context lost/i.test(c)),
        [],
    );
    await page.close();
});

test("the picture has the pixels of its window, panel and screen, and is right in each", { skip }, async () => {
    const { page, complaints } = await openPanes();
    const sizes = async () => {
        isSeen(await middle(page), throughPanes("front"));
        return /** @type {any} */ (
            await page.evaluate(() => {
                const { canvas } = /** @type {any} */ (globalThis).twinray.renderer;
                const frame = /** @type {any} */ (globalThis).twinray.camera.aspect;
                const ratio = Math.min(devicePixelRatio, 2);
                const fits =
                    canvas.width === Math.round(canvas.clientWidth * ratio) &&
                    canvas.height === Math.round(canvas.clientHeight * ratio);
                const aspect = Math.abs(frame - canvas.clientWidth / canvas.clientHeight) < 1e-9;
                return { width: canvas.width, height: canvas.height, fits: fits && aspect };
            })
        );
    };
    const first = await sizes();
    assert.ok(first.fits);
    await page.focus("canvas");
    await page.keyboard.press("p");
    await page.waitForFunction(`window.twinray.renderer.canvas.width > ${first.width}`);
    const wide = await sizes();
    assert.ok(wide.fits && wide.height === first.height, JSON.stringify(wide));
    await page.setViewport({ width: 600, height: 400 });
    await page.waitForFunction("window.twinray.renderer.canvas.width <= 600");
    assert.ok((await sizes()).fits);
    // As a page is zoomed: without a window, Chromium tells nobody of another ratio alone. More than 2 is not worth its time.
    for (const [deviceScaleFactor, width, pixels] of [
        [1.5, 400, 600],
        [3, 300, 600],
        [1, 600, 600],
    ]) {
        await page.setViewport({ width, height: 400, deviceScaleFactor });
        // All are as wide in pixels as the one before: the rows tell that the page has followed.
        const followed = (/** @type {number} */ ratio, /** @type {number} */ width, /** @type {number} */ pixels) => {
            const { canvas } = /** @type {any} */ (globalThis).twinray.renderer;
            const rows = Math.round(canvas.clientHeight * Math.min(ratio, 2));
            return innerWidth === width && canvas.width === pixels && canvas.height === rows;
        };
        await page.waitForFunction(followed, {}, deviceScaleFactor, width, pixels);
        assert.ok((await sizes()).fits);
    }
    assert.deepEqual(complaints, []);
    await page.close();
});

test("a camera without perspective is seen in one from the same place, which its button says", { skip }, async () => {
    const { page, complaints } = await openPanes();
    const button = await page.$eval("#cameras button:nth-of-type(3)", (b) => ({
        text: b.textContent,
        title: /** @type {HTMLElement} */ (b).title,
    }));
    assert.equal(button.text, "plan (in perspective)");
    assert.match(button.title, /A parallel projection, shown in perspective from the same place/);
    assert.equal(await page.$eval("#cameras button", (b) => b.textContent), "front");
    await page.click("#cameras button:nth-of-type(3)");
    isSeen(await middle(page), throughPanes("front"));
    const { eye, fov } = /** @type {any} */ (await page.evaluate("window.twinray.camera.pose"));
    assert.ok(Math.hypot(eye[0], eye[1], eye[2] - 2) < 1e-6, String(eye));
    // Half of its height is 1, at a distance of 2.
    assert.ok(Math.abs(fov - 2 * Math.atan(0.5)) < 1e-6, String(fov));
    await page.screenshot({ path: join(PICTURES, "plan.png") });
    assert.deepEqual(complaints, []);
    await page.close();
});
