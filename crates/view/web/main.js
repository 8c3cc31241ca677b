/**
 * Starts the page and ties its parts together: scene, renderer, camera, controls, panel, address and solve. What each of them
 * does stands in its own module; here stands only who tells whom.
 */

import { createActions } from "twinray/actions.js";
import { element, toast } from "twinray/announce.js";
import { Camera, overview } from "twinray/camera.js";
import { Controls } from "twinray/controls.js";
import { showLegend } from "twinray/legend.js";
import { colourScale, naturalMode, rendererOptions } from "twinray/options.js";
import { Panel } from "twinray/panel.js";
import { showStored } from "twinray/progress.js";
import { Readings } from "twinray/readings.js";
import { Renderer } from "twinray/renderer.js";
import { DEFAULTS, Settings } from "twinray/settings.js";
import { setUpSheet } from "twinray/sheet.js";
import { setUpShortcuts, welcome } from "twinray/shortcuts.js";
import { Solve } from "twinray/solve.js";
import { Ticker } from "twinray/ticker.js";
import { AddressWriter, format, parse } from "twinray/url.js";
import { dot, length, sub } from "twinray/vec.js";
import { loadWalk } from "twinray/walk.js";

/** @import { FrameInfo, Pose, RendererLike, Walk } from "twinray/types.js" */

/** A camera that has not moved for so long is at rest. */
const REST_MILLISECONDS = 200;
/** Long enough that nobody wonders at an empty picture. */
const LOST_MILLISECONDS = 60_000;

try {
    await start();
} catch (error) {
    showFailure(error instanceof Error ? error.message : String(error));
    throw error;
}

async function start() {
    setUpSheet();
    const canvas = /** @type {HTMLCanvasElement} */ (element("view"));
    /** @type {Walk} */
    const walk = await loadWalk();
    /** @type {RendererLike} */
    const renderer = new Renderer(canvas, walk);
    // A renderer that has lost its context answers nothing; then there is nothing where one clicks.
    const pick = (/** @type {number} */ x, /** @type {number} */ y) => renderer.pick(x, y).catch(() => null);

    const home = (typeof walk.home === "number" ? walk.cameras[walk.home] : walk.home) ?? overview(walk.radius);
    const linked = parse(walk, location.hash);
    const pose = linked.pose ?? home;
    const ticker = new Ticker();
    const camera = new Camera(pose, linked.distance ?? length(pose.eye), walk.radius, ticker);
    const settings = new Settings({ mode: naturalMode(walk, home), ...linked.values });
    const readings = new Readings(walk, camera, canvas, pick);
    const address = new AddressWriter(() => format(walk, camera.destination, camera.distance, settings.values));
    /** @type {FrameInfo | null} */
    let frame = null;
    /** @type {Solve | null} */
    let solve = null;
    const scale = () => colourScale(settings.values, frame?.illuminanceRange ?? null, walk.unit);

    /** Takes what is in the middle of the picture as that around which to turn. */
    const aim = async () => {
        camera.onarrive = () => {};
        const { pose } = camera;
        const found = await pick(canvas.clientWidth / 2, canvas.clientHeight / 2);
        if (found && camera.pose === pose) camera.aim(dot(sub(found.point, pose.eye), pose.forward));
    };
    const goTo = (/** @type {Pose} */ to) => {
        camera.onarrive = aim;
        camera.go(to, length(to.eye));
    };
    const pause = () => solve?.toggle();
    const link = () => {
        address.flush();
        return location.href;
    };
    const actions = createActions({
        ...{ walk, renderer, camera, settings, readings, canvas, home },
        ...{ goTo, scale, pause, link },
    });

    const panel = new Panel(walk, camera, settings, actions);
    setUpShortcuts(actions);
    new Controls(canvas, camera, settings, ticker, walk.radius, {
        depth: async ({ x, y }) => (await pick(x, y))?.point ?? null,
        click: ({ x, y }) => settings.values.picking && readings.take(x, y),
        doubleClick: async ({ x, y }) => {
            const found = settings.values.picking ? null : await pick(x, y);
            if (found) camera.focus(found.point);
        },
        hover: (place) => {
            if (settings.values.picking || place === null) readings.hover(place);
        },
    });

    // An address says what a visitor changed; a page that was only opened keeps the one it was opened with.
    let started = false;
    /** @type {ReturnType<typeof setTimeout> | undefined} */
    let rest;
    const draw = () => {
        renderer.setView(camera.view);
        panel.moved();
        readings.place();
    };
    camera.onchange = () => {
        draw();
        if (started) address.schedule();
        clearTimeout(rest);
        if (readings.count > 0) rest = setTimeout(() => readings.refresh(), REST_MILLISECONDS);
    };
    settings.listen((values, changed) => {
        renderer.setOptions(rendererOptions(values, changed));
        showLegend(scale());
        if (!values.picking) readings.hover(null);
        if (!started) return;
        address.schedule();
        if (changed.mode === "orbit") aim();
    });
    renderer.onframe = (info) => {
        const before = frame;
        frame = info;
        if (before && sameFrame(before, info)) return;
        panel.inUse(info.exposure, info.illuminanceRange);
        showLegend(scale());
    };
    renderer.onlost = () => {
        // What is shown stands in the address by the time the page loads again.
        address.flush();
        toast("The graphics processor was taken away; the picture comes back with it", LOST_MILLISECONDS);
    };
    const resized = () => {
        camera.aspect = canvas.clientWidth / (canvas.clientHeight || 1);
        renderer.resize();
        draw();
    };
    new ResizeObserver(resized).observe(canvas);
    onPixelRatio(resized);
    window.addEventListener("hashchange", () => {
        if (location.hash === address.written) return;
        const next = parse(walk, location.hash);
        settings.set({ ...DEFAULTS, mode: naturalMode(walk, home), ...next.values });
        if (next.pose) camera.go(next.pose, next.distance ?? camera.distance);
    });

    camera.aspect = canvas.clientWidth / (canvas.clientHeight || 1);
    draw();
    if (linked.distance === null) aim();
    if (walk.live) solve = new Solve(walk, renderer, readings);
    else showStored(walk);
    started = true;
    element("cover").hidden = true;
    document.body.dataset.page = "ready";
    if (!location.hash) welcome(settings.values.mode);
    Object.assign(window, { twinray: { walk, renderer, camera, live: solve?.live ?? null, settings, readings } });
}

/** Tells of pixels of another size, as on another screen, which change no length on the page. @param {() => void} tell */
function onPixelRatio(tell) {
    const changed = () => {
        tell();
        onPixelRatio(tell);
    };
    matchMedia(`(resolution: ${devicePixelRatio}dppx)`).addEventListener("change", changed, { once: true });
}

/** Says why there is nothing to see. @param {string} message */
function showFailure(message) {
    document.body.dataset.page = "failed";
    const cover = element("cover");
    cover.hidden = false;
    cover.dataset.failed = "true";
    element("cover-text").setAttribute("role", "alert");
    element("cover-text").textContent = message;
    const reload = element("cover-reload");
    reload.hidden = false;
    reload.addEventListener("click", () => location.reload());
}

/** Whether the panel has nothing new to show. @param {FrameInfo} a @param {FrameInfo} b */
const sameFrame = (a, b) =>
    a.exposure === b.exposure && a.illuminanceRange.every((x, i) => x === b.illuminanceRange[i]);
