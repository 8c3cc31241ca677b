/**
 * What buttons and keys do, each by its name: one place for both, so that they cannot differ.
 */

import { announce, toast } from "twinray/announce.js";
import { overview } from "twinray/camera.js";
import { stops } from "twinray/colours.js";
import { copy, savePicture } from "twinray/screenshot.js";
import { togglePanel } from "twinray/sheet.js";
import { toggleHelp } from "twinray/shortcuts.js";

/** @import { Camera } from "twinray/camera.js" */
/** @import { Scale } from "twinray/legend.js" */
/** @import { Readings } from "twinray/readings.js" */
/** @import { Settings } from "twinray/settings.js" */
/** @import { Curve, Pose, RendererLike, Walk } from "twinray/types.js" */

/**
 * The parts of the page that actions act on, and what only `main.js` knows.
 * @typedef {object} Parts
 * @property {Walk} walk
 * @property {RendererLike} renderer
 * @property {Camera} camera
 * @property {Settings} settings
 * @property {Readings} readings
 * @property {HTMLCanvasElement} canvas
 * @property {Pose} home
 * @property {(to: Pose) => void} goTo
 * @property {() => Scale | null} scale
 * @property {() => void} pause
 * @property {() => string} link the address of this view
 */

/** @typedef {ReturnType<typeof createActions>} Actions */

/** @type {Record<Curve, string>} */
const CURVES = { agx: "AgX", aces: "ACES", reinhard: "Reinhard", none: "none" };
const FOV_STEP = (5 * Math.PI) / 180;
/** Bounds of the speed of flight, in powers of two, as the slider has them. */
const SPEEDS = 3;

/** @param {Parts} parts */
export function createActions(parts) {
    const { walk, renderer, camera, settings, readings, canvas } = parts;
    /** @type {(pose: Pose, says: string) => void} */
    const goTo = (pose, says) => {
        parts.goTo(pose);
        announce(says);
    };
    /** @type {(name: "falseColour" | "cells" | "logarithmic", on: string, off: string) => void} */
    const flip = (name, on, off) => {
        settings.set({ [name]: !settings.values[name] });
        announce(settings.values[name] ? on : off);
    };

    return {
        home: () => goTo(parts.home, "Home"),
        overview: () => goTo(overview(walk.radius), "The whole scene"),
        camera: (/** @type {number} */ index) => {
            if (walk.cameras[index]) goTo(walk.cameras[index], cameraName(walk, index));
        },
        mode: () => {
            settings.set({ mode: settings.values.mode === "orbit" ? "fly" : "orbit" });
            toast(settings.values.mode === "orbit" ? "Orbit" : "Fly");
        },
        fov: (/** @type {number} */ steps) => camera.setFov(camera.pose.fov + steps * FOV_STEP),
        speed: (/** @type {number} */ steps) => {
            const power = Math.log2(settings.values.speed) + steps / 2;
            settings.set({ speed: 2 ** Math.min(Math.max(power, -SPEEDS), SPEEDS) });
            toast(`Speed × ${Number(settings.values.speed.toPrecision(2))}`);
        },
        exposure: (/** @type {number} */ steps) => {
            const thirds = 3 * (settings.values.exposure ?? renderer.exposure);
            settings.set({ exposure: Math.round(thirds + steps) / 3 });
            toast(stops(settings.values.exposure ?? 0));
        },
        autoExposure: () => {
            settings.set({ exposure: settings.values.exposure === null ? renderer.exposure : null });
            toast(settings.values.exposure === null ? "Automatic exposure" : "Exposure held");
        },
        curve: () => {
            const names = /** @type {Curve[]} */ (Object.keys(CURVES));
            settings.set({ curve: names[(names.indexOf(settings.values.curve) + 1) % names.length] });
            toast(`Tone curve: ${CURVES[settings.values.curve]}`);
        },
        falseColour: () => flip("falseColour", "False colour", "True colour"),
        scale: () => flip("logarithmic", "Logarithmic scale", "Linear scale"),
        cells: () => flip("cells", "Cells shown", "Cells hidden"),
        picking: () => {
            settings.set({ picking: !settings.values.picking });
            toast(settings.values.picking ? "Click a point, or press Enter for the middle" : "Readings ended");
        },
        pickMiddle: () => {
            if (settings.values.picking) readings.take(canvas.clientWidth / 2, canvas.clientHeight / 2);
        },
        escape: () => {
            if (settings.values.picking) settings.set({ picking: false });
            else readings.closeOne();
        },
        pause: parts.pause,
        screenshot: async () => {
            try {
                await savePicture(await renderer.screenshot(), walk.name, parts.scale(), readings.marks);
            } catch (error) {
                toast(`No picture: ${error instanceof Error ? error.message : error}`);
            }
        },
        fullscreen: () => {
            const change = document.fullscreenElement
                ? document.exitFullscreen()
                : document.documentElement.requestFullscreen();
            change.catch(() => toast("Full screen is not allowed here"));
        },
        link: () => copy(parts.link(), "Link copied"),
        panel: togglePanel,
        help: toggleHelp,
    };
}

/** What a camera of the scene is called. @param {Walk} walk @param {number} index */
export const cameraName = (walk, index) =>
    (walk.cameras[index].name || `Camera ${index + 1}`) + (isPlain(walk, index) ? "" : " (in perspective)");

/** What a camera is in the scene, where the page has to show something else. @param {Walk} walk @param {number} index */
export const cameraNote = (walk, index) =>
    isPlain(walk, index)
        ? ""
        : `${PROJECTIONS[walk.cameras[index].projection ?? ""] ?? "Another projection"}, shown in perspective from the same place`;

/** @type {Record<string, string>} */
const PROJECTIONS = { parallel: "A parallel projection", panorama: "A panorama", fisheye: "A fisheye" };

/** @param {Walk} walk @param {number} index */
const isPlain = (walk, index) => (walk.cameras[index].projection ?? "perspective") === "perspective";
