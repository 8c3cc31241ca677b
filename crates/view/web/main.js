/**
 * Starts the page and ties its parts together: scene, renderer, camera, controls, panel, address and live light. What each of
 * them does stands in its own module; here stands only who tells whom.
 */

import { announce, element, toast } from "twinray/announce.js";
import { Camera } from "twinray/camera.js";
import { colourTable, stops } from "twinray/colours.js";
import { Controls } from "twinray/controls.js";
import { showLegend } from "twinray/legend.js";
import { Live } from "twinray/live.js";
import { cameraName, Panel } from "twinray/panel.js";
import { showStatus, showStored } from "twinray/progress.js";
import { Readings } from "twinray/readings.js";
import { Renderer } from "twinray/renderer.js";
import { copy, savePicture } from "twinray/screenshot.js";
import { Settings } from "twinray/settings.js";
import { setUpSheet, togglePanel } from "twinray/sheet.js";
import { setUpShortcuts, toggleHelp } from "twinray/shortcuts.js";
import { Ticker } from "twinray/ticker.js";
import { AddressWriter, format, parse } from "twinray/url.js";
import { dot, length, sub } from "twinray/vec.js";
import { loadWalk } from "twinray/walk.js";

/** @import { Scale } from "twinray/legend.js" */
/** @import { Actions } from "twinray/shortcuts.js" */
/** @import { Curve, FrameInfo, LiveLike, Options, Pose, RendererLike, Status, Values, Walk } from "twinray/types.js" */

const CURVES = /** @type {Curve[]} */ (["agx", "aces", "reinhard", "none"]);
const CURVE_NAMES = { agx: "AgX", aces: "ACES", reinhard: "Reinhard", none: "none" };
/** Light that is known to be 1 % better is no news for a reading. */
const REFRESH_MILLISECONDS = 1000;
const FOV_STEP = (5 * Math.PI) / 180;

try {
    await start();
} catch (error) {
    const cover = element("cover");
    cover.hidden = false;
    cover.dataset.failed = "true";
    element("cover-text").setAttribute("role", "alert");
    element("cover-text").textContent = error instanceof Error ? error.message : String(error);
    element("solve-state").textContent = "Not loaded";
    throw error;
}

async function start() {
    setUpSheet();
    const canvas = /** @type {HTMLCanvasElement} */ (element("view"));
    /** @type {Walk} */
    const walk = await loadWalk();
    /** @type {RendererLike} */
    const renderer = new Renderer(canvas, walk);
    const home = typeof walk.home === "number" ? walk.cameras[walk.home] : walk.home;
    const linked = parse(walk, location.hash);
    const pose = linked.pose ?? home;

    const ticker = new Ticker();
    const camera = new Camera(pose, linked.distance ?? length(pose.eye), walk.radius, ticker);
    const settings = new Settings({ mode: naturalMode(walk, home), ...linked.values });
    const readings = new Readings(walk, camera, canvas, (x, y) => renderer.pick(x, y));
    /** @type {LiveLike | null} */
    let live = null;
    /** @type {Status | null} */
    let status = null;
    /** @type {FrameInfo | null} */
    let frame = null;

    const actions = /** @type {Actions} */ ({
        home: () => goTo(home, "Home"),
        camera: (i) => walk.cameras[i] && goTo(walk.cameras[i], cameraName(walk.cameras, i)),
        mode: () => {
            settings.set({ mode: settings.values.mode === "orbit" ? "fly" : "orbit" });
            toast(settings.values.mode === "orbit" ? "Orbit" : "Fly");
        },
        fov: (steps) => camera.setFov(camera.pose.fov + steps * FOV_STEP),
        speed: (steps) => {
            settings.set({ speed: 2 ** Math.min(Math.max(Math.log2(settings.values.speed) + steps / 2, -3), 3) });
            toast(`Speed × ${Number(settings.values.speed.toPrecision(2))}`);
        },
        exposure: (steps) => {
            const exposure = settings.values.exposure ?? renderer.exposure;
            settings.set({ exposure: Math.round(3 * exposure + steps) / 3 });
            toast(stops(settings.values.exposure ?? 0));
        },
        autoExposure: () => {
            settings.set({ exposure: settings.values.exposure === null ? renderer.exposure : null });
            toast(settings.values.exposure === null ? "Automatic exposure" : "Exposure held");
        },
        curve: () => {
            settings.set({ curve: CURVES[(CURVES.indexOf(settings.values.curve) + 1) % CURVES.length] });
            toast(`Tone curve: ${CURVE_NAMES[settings.values.curve]}`);
        },
        falseColour: () => settings.set({ falseColour: !settings.values.falseColour }),
        scale: () => settings.set({ logarithmic: !settings.values.logarithmic }),
        cells: () => settings.set({ cells: !settings.values.cells }),
        picking: () => {
            settings.set({ picking: !settings.values.picking });
            announce(settings.values.picking ? "Click a point, or press Enter for the middle" : "Readings ended");
        },
        pickMiddle: () => {
            if (settings.values.picking) readings.take(canvas.clientWidth / 2, canvas.clientHeight / 2);
        },
        escape: () => {
            if (settings.values.picking) settings.set({ picking: false });
            else readings.closeOne();
        },
        pause: () => {
            if (!live || !status) return;
            const change = status.state === "paused" ? live.resume() : status.state === "solving" ? live.pause() : null;
            change?.catch((/** @type {unknown} */ error) =>
                toast(error instanceof Error ? error.message : String(error)),
            );
        },
        screenshot: async () => savePicture(await renderer.screenshot(), walk.name, scale()),
        fullscreen: () => {
            const change = document.fullscreenElement
                ? document.exitFullscreen()
                : document.documentElement.requestFullscreen();
            change.catch(() => toast("Full screen is not allowed here"));
        },
        link: () => {
            address.flush();
            copy(location.href, "Link copied");
        },
        panel: togglePanel,
        help: toggleHelp,
    });

    const address = new AddressWriter(() => format(walk, camera.destination, camera.distance, settings.values));
    const panel = new Panel(walk, camera, settings, actions);
    new Controls(canvas, camera, settings, ticker, walk.radius, {
        depth: async ({ x, y }) => (await renderer.pick(x, y))?.point ?? null,
        click: ({ x, y }) => settings.values.picking && readings.take(x, y),
        doubleClick: async ({ x, y }) => {
            if (settings.values.picking) return;
            const pick = await renderer.pick(x, y);
            if (pick) camera.focus(pick.point);
        },
        hover: (place) => {
            if (settings.values.picking || place === null) readings.hover(place);
        },
    });
    setUpShortcuts(actions);

    camera.onchange = () => {
        renderer.setView(camera.view);
        panel.moved();
        readings.place();
        address.schedule();
    };
    settings.listen((values, changed) => {
        renderer.setOptions(optionsOf(changed));
        showLegend(scale());
        if (!values.picking) readings.hover(null);
        address.schedule();
    });
    renderer.onframe = (info) => {
        const before = frame;
        frame = info;
        if (before && before.exposure === info.exposure && sameRange(before, info)) return;
        panel.inUse(info.exposure, info.illuminanceRange);
        showLegend(scale());
    };
    new ResizeObserver(() => {
        camera.aspect = canvas.clientWidth / (canvas.clientHeight || 1);
        renderer.resize();
        camera.onchange();
    }).observe(canvas);
    window.addEventListener("hashchange", () => {
        if (location.hash === address.written) return;
        const next = parse(walk, location.hash);
        settings.set({ exposure: null, range: null, falseColour: false, cells: false, ...next.values });
        if (next.pose) camera.go(next.pose, next.distance ?? camera.distance);
    });

    camera.aspect = canvas.clientWidth / (canvas.clientHeight || 1);
    camera.onchange();
    if (linked.distance === null) await aim();
    element("cover").hidden = true;

    let refreshed = 0;
    if (walk.live) {
        live = new Live(walk, {
            onLight: (/** @type {unknown} */ light) => {
                renderer.setLight(light);
                const now = performance.now();
                if (readings.count === 0 || now - refreshed < REFRESH_MILLISECONDS) return;
                refreshed = now;
                readings.refresh();
            },
            onStatus: (/** @type {Status} */ next) => {
                const ended = next.state !== status?.state && next.state !== "solving";
                status = next;
                showStatus(next);
                if (ended) readings.refresh();
            },
        });
    } else {
        showStored(walk);
    }
    Object.assign(window, { twinray: { walk, renderer, camera, live, settings, readings } });

    /** @param {Pose} to @param {string} says */
    function goTo(to, says) {
        camera.onarrive = aim;
        camera.go(to, length(to.eye));
        announce(says);
    }

    /** Takes what is in the middle of the picture as that around which to turn. */
    async function aim() {
        camera.onarrive = () => {};
        const { pose } = camera;
        const pick = await renderer.pick(canvas.clientWidth / 2, canvas.clientHeight / 2).catch(() => null);
        if (pick && camera.pose === pose)
            camera.set(camera.pose, dot(sub(pick.point, camera.pose.eye), camera.pose.forward));
    }

    /** The scale of the colours in use; null without false colours. @returns {Scale | null} */
    function scale() {
        const { falseColour, range, logarithmic, map } = settings.values;
        const inUse = range ?? frame?.illuminanceRange;
        if (!falseColour || !inUse) return null;
        const [low, high] = logarithmic ? positive(inUse) : inUse;
        return { low, high, logarithmic, unit: walk.unit.name, colours: colourTable(map) };
    }

    /** The renderer's options among what has changed. @param {Partial<Values>} changed @returns {Partial<Options>} */
    function optionsOf({ map, mode: _mode, speed: _speed, picking: _picking, ...options }) {
        const { range, logarithmic } = settings.values;
        if ("range" in options || "logarithmic" in options) {
            options.range = range && logarithmic ? positive(range) : range;
        }
        return map ? { ...options, colours: colourTable(map) } : options;
    }
}

/** A range that has logarithms: three decades, where it starts from nothing. @param {[number, number]} range @returns {[number, number]} */
const positive = ([low, high]) => [low > 0 ? low : high / 1000, high];

/** @param {FrameInfo} a @param {FrameInfo} b */
const sameRange = (a, b) => a.illuminanceRange.every((x, i) => x === b.illuminanceRange[i]);

/**
 * A room is looked at from within, a thing from around it.
 * @param {Walk} walk
 * @param {Pose} home
 */
function naturalMode({ bounds: [low, high] }, { eye }) {
    return eye.every((x, i) => x > low[i] && x < high[i]) ? "fly" : "orbit";
}
