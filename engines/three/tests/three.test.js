/** `twinray bake` and three.js: what the engine shows of a baked file is what twinray shows of the scene. */

import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { createReadStream, existsSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { createServer } from "node:http";
import { tmpdir } from "node:os";
import { extname, join, normalize } from "node:path";
import { after, before, test } from "node:test";

import puppeteer from "puppeteer-core";

import { COLOUR, roomFile } from "./room.js";

const HERE = new URL("..", import.meta.url).pathname;
const TWINRAY = process.env.TWINRAY ?? "twinray";
const BINARY =
    process.env.CHROMIUM ??
    ["/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"].find(existsSync);
const TYPES = { ".html": "text/html", ".js": "text/javascript", ".glb": "model/gltf-binary" };
const SHOTS = process.env.SHOTS;

/** @type {string} */ let folder;
/** @type {import("node:http").Server} */ let server;
/** @type {string} */ let url;
/** @type {import("puppeteer-core").Browser} */ let browser;

before(async () => {
    folder = mkdtempSync(join(tmpdir(), "twinray-three-"));
    server = createServer((request, response) => {
        const path = normalize(decodeURI(new URL(request.url ?? "/", "http://x").pathname));
        const file = path.startsWith("/made/") ? join(folder, path.slice(6)) : join(HERE, path);
        if (path === "/favicon.ico") return void response.writeHead(204).end();
        if (!existsSync(file)) return void response.writeHead(404).end();
        const type = TYPES[/** @type {keyof TYPES} */ (extname(file))] ?? "application/octet-stream";
        response.writeHead(200, { "content-type": type });
        createReadStream(file).pipe(response);
    });
    await new Promise((resolve) => server.listen(0, "127.0.0.1", () => resolve(undefined)));
    url = `http://127.0.0.1:${/** @type {import("node:net").AddressInfo} */ (server.address()).port}`;
    if (!BINARY) throw new Error("no chromium found; name one in CHROMIUM");
    browser = await puppeteer.launch({
        executablePath: BINARY,
        headless: true,
        args: [
            ...(process.getuid?.() === 0 ? ["--no-sandbox"] : []),
            "--use-angle=swiftshader",
            "--enable-unsafe-swiftshader",
            "--ignore-gpu-blocklist",
        ],
    });
});

after(async () => {
    await browser?.close();
    server?.close();
    rmSync(folder, { recursive: true, force: true });
});

/** @param {string[]} args */
const twinray = (...args) =>
    execFileSync(TWINRAY, args, { cwd: folder, encoding: "utf8", stdio: ["ignore", "pipe", "inherit"] });

/**
 * Bakes a scene, takes its picture, and compares.
 * @param {string} name
 * @param {string[]} how
 * @param {{ scene?: string, rays?: string }} [what]
 */
async function compared(name, how, { scene = name, rays = "20M" } = {}) {
    twinray("solve", scene, "--rays", rays, "-o", `${name}.twin`, "-q");
    const report = JSON.parse(twinray("bake", `${name}.twin`, "-o", `${name}.glb`, "-q", "--json", ...how));
    twinray(
        "render",
        `${name}.twin`,
        "-o",
        `${name}.exr`,
        "--size",
        "480x360",
        "--method",
        "gather",
        "--samples",
        "16",
        "-q",
    );
    const page = await browser.newPage();
    /** @type {string[]} */
    const complaints = [];
    page.on("console", (m) => ["error", "warn"].includes(m.type()) && complaints.push(m.text()));
    page.on("pageerror", (error) => complaints.push(String(error)));
    await page.goto(`${url}/tests/page.html`);
    await page.waitForFunction("document.body.dataset.page === 'ready'");
    const found = await page.evaluate(`compare("/made/${name}.glb", "/made/${name}.exr")`);
    if (SHOTS)
        await page.screenshot({ path: join(SHOTS, `${name}.png`), clip: { x: 8, y: 8, width: 480, height: 360 } });
    await page.close();
    return { report, found: /** @type {any} */ (found), complaints };
}

for (const [name, how, p50] of /** @type {[string, string[], number][]} */ ([
    ["cornell", ["--density", "100"], 0.02],
    ["doorway", ["--density", "20"], 0.04],
    ["hall-diffuse", [], 0.05],
])) {
    test(`${name} looks as twinray shows it`, async () => {
        const { report, found, complaints } = await compared(name, how);
        console.log(name, found, report.bake.layout);
        assert.deepEqual(complaints, []);
        assert.ok(found.lightmaps > 0);
        assert.ok(Math.abs(found.ratio - 1) < 0.02, `ratio of means ${found.ratio}`);
        assert.ok(Math.abs(found.median - 1) < 0.02, `median ratio ${found.median}`);
        assert.ok(found.p50 < p50, `half of the squares within ${found.p50}`);
        assert.equal(found.lights, 0);
        assert.ok(report.bake.layout.seams.p99 < 0.02, `seams jump by ${report.bake.layout.seams.p99}`);
    });
}

for (const colours of [false, true]) {
    const over = colours ? "over" : "without";
    test(`light at vertices looks as twinray shows it, ${over} the author's colours`, async () => {
        const name = colours ? "painted" : "room";
        writeFileSync(join(folder, `${name}.gltf`), roomFile(40, colours));
        const { report, found, complaints } = await compared(name, ["--to", "vertex"], {
            scene: `${name}.gltf`,
            rays: "6M",
        });
        console.log(name, found, report.bake.layout);
        assert.deepEqual(complaints, []);
        assert.equal(report.bake.layout.carrier, "vertex");
        assert.equal(found.lightmaps, 0);
        assert.equal(found.coloured > 0, colours);
        // twinray takes no colours of vertices, which three.js multiplies what it shows by.
        const [red, green, blue] = colours ? COLOUR : [1, 1, 1];
        const expected = 0.2126 * red + 0.7152 * green + 0.0722 * blue;
        assert.ok(Math.abs(found.ratio / expected - 1) < 0.02, `ratio of means ${found.ratio}`);
        assert.ok(Math.abs(found.median / expected - 1) < 0.02, `median ratio ${found.median}`);
        if (!colours) assert.ok(found.p50 < 0.03, `half of the squares within ${found.p50}`);
    });
}

test("equal commands give equal bytes, on one thread and on two", () => {
    const files = ["1", "2"].map((threads) => {
        twinray("bake", "cornell", "-o", `t${threads}.glb`, "--rays", "2M", "--threads", threads, "-q");
        return readFileSync(join(folder, `t${threads}.glb`));
    });
    assert.ok(files[0].equals(files[1]));
});
