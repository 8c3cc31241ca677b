/**
 * The parts of the page that need no browser: poses, links, numbers, ticks.
 */

import assert from "node:assert/strict";
import { test } from "node:test";

import {
    anglesOf,
    between,
    dolly,
    focused,
    frameOf,
    look,
    MAX_FOV,
    move,
    orbit,
    pan,
    samePose,
    viewFov,
} from "twinray/camera.js";
import { colourTable, count, duration, number, percent, plusMinus, stops } from "twinray/colours.js";
import { ticks } from "twinray/legend.js";
import { parseNumber } from "twinray/panel.js";
import { done } from "twinray/progress.js";
import { fileName } from "twinray/screenshot.js";
import { DEFAULTS, Settings } from "twinray/settings.js";
import { format, parse } from "twinray/url.js";
import { along, cross, dot, length, normalize, sub } from "twinray/vec.js";

/** @import { Pose, Values, Vec3, Walk } from "twinray/types.js" */

/** Numbers from 0 to 1 that are the same in every run. @param {number} seed */
function numbers(seed) {
    let state = seed >>> 0;
    return () => {
        state = (Math.imul(state, 1664525) + 1013904223) >>> 0;
        return state / 2 ** 32;
    };
}

/** @param {() => number} next @returns {Pose} */
function anyPose(next) {
    const angles = { yaw: 6.28 * next(), pitch: 3 * (next() - 0.5), roll: 2 * (next() - 0.5) };
    const { forward, up } = frameOf(angles);
    return { eye: [9 * next(), 9 * next(), 9 * next()], forward, up, fov: 0.3 + next() };
}

/** @type {(a: Vec3, b: Vec3, tolerance?: number) => void} */
const near = (a, b, tolerance = 1e-9) => assert.ok(length(sub(a, b)) < tolerance, `${a} is not ${b}`);

test("a frame is orthonormal and right-handed, and its angles come back", () => {
    const next = numbers(1);
    for (let i = 0; i < 200; i++) {
        const { forward, up } = anyPose(next);
        const frame = frameOf(anglesOf({ forward, up }));
        near(frame.forward, forward);
        near(frame.up, up);
        near(frame.right, cross(forward, up));
        assert.ok(Math.abs(dot(frame.forward, frame.up)) < 1e-12);
    }
});

test("straight down, as plans are seen, up stays where it was", () => {
    for (const up of /** @type {Vec3[]} */ ([[0, 0, -1], [1, 0, 0], normalize([0.3, 0, 0.7])])) {
        const down = frameOf(anglesOf({ forward: [0, -1, 0], up }));
        near(down.forward, [0, -1, 0]);
        near(down.up, up);
        const sky = frameOf(anglesOf({ forward: [0, 1, 0], up }));
        near(sky.up, up);
    }
});

test("an orbit keeps its target and distance; looking keeps the eye; both stop at the poles", () => {
    const next = numbers(2);
    for (let i = 0; i < 100; i++) {
        const pose = anyPose(next);
        const turned = orbit(pose, 4, next() - 0.5, next() - 0.5);
        near(along(turned.eye, turned.forward, 4), along(pose.eye, pose.forward, 4), 1e-8);
        assert.deepEqual(look(pose, 0.3, 0.2).eye, pose.eye);
        assert.ok(look(pose, 0, 9).forward[1] > 0.999999);
        assert.ok(orbit(pose, 1, 0, -9).forward[1] < -0.999999);
    }
});

test("a level horizon stays level under every movement", () => {
    const next = numbers(3);
    /** @type {Pose} */
    let pose = { eye: [0, 0, 0], forward: [0, 0, -1], up: [0, 1, 0], fov: 1 };
    for (let i = 0; i < 500; i++) {
        pose = orbit(look(pose, next() - 0.5, next() - 0.5), 2, next() - 0.5, next() - 0.5);
        pose = pan(move(pose, [next(), 0, -next()]), next(), next());
    }
    assert.equal(anglesOf(pose).roll, 0);
});

test("a dolly keeps the direction to its point, and focus puts it in the middle", () => {
    const next = numbers(4);
    for (let i = 0; i < 100; i++) {
        const pose = anyPose(next);
        /** @type {Vec3} */
        const point = [9 * next(), 9 * next(), -9];
        const nearer = dolly(pose, point, 0.5);
        near(normalize(sub(point, nearer.eye)), normalize(sub(point, pose.eye)));
        assert.ok(Math.abs(length(sub(point, nearer.eye)) / length(sub(point, pose.eye)) - 0.5) < 1e-9);
        const seen = focused(pose, point, 2);
        near(along(seen.eye, seen.forward, 2), point, 1e-8);
    }
});

test("a transition begins and ends where it should, and turns the short way", () => {
    const next = numbers(5);
    for (let i = 0; i < 100; i++) {
        const [a, b] = [anyPose(next), anyPose(next)];
        assert.ok(samePose(between(a, b, 0), a, 1));
        assert.ok(samePose(between(a, b, 1), b, 1));
    }
    const [left, right] = [3.1, -3.1].map((yaw) => ({ ...anyPose(next), ...frameOf({ yaw, pitch: 0, roll: 0 }) }));
    assert.ok(between(left, right, 0.5).forward[2] > 0.999);
});

test("an upright window widens the vertical angle and keeps the horizontal one", () => {
    assert.equal(viewFov(1, 1.6), 1);
    assert.ok(Math.abs(Math.tan(viewFov(0.8, 0.5) / 2) * 0.5 - Math.tan(0.4)) < 1e-12);
    assert.ok(viewFov(MAX_FOV, 0.2) < 2.4);
});

/** @type {Walk} */
const WALK = {
    name: "w",
    up: [0, 1, 0],
    centre: [512_000, 40, -9000],
    radius: 12,
    bounds: [
        [-9, -9, -9],
        [9, 9, 9],
    ],
    cameras: [],
    home: 0,
    unit: { name: "lx", factor: 179 },
    live: false,
    base: "",
    materials: [],
    stats: { triangles: 0, cells: 0, rays: 0, error: 0 },
    generator: "",
    scene: { header: {}, arrays: {} },
    light: null,
};

test("a link brings back pose and settings", () => {
    const next = numbers(6);
    for (let i = 0; i < 100; i++) {
        const pose = anyPose(next);
        /** @type {Values} */
        const values = {
            ...DEFAULTS,
            exposure: next() < 0.5 ? null : Math.round(100 * next()) / 10,
            curve: next() < 0.5 ? "aces" : "agx",
            falseColour: next() < 0.5,
            range: next() < 0.5 ? null : [next(), 500 + Math.round(100 * next())],
            logarithmic: next() < 0.5,
            cells: next() < 0.5,
            map: next() < 0.5 ? "turbo" : "viridis",
            mode: next() < 0.5 ? "orbit" : "fly",
            speed: 2 ** Math.round(4 * next() - 2),
        };
        const linked = parse(WALK, `#${format(WALK, pose, 3.25, values)}`);
        assert.ok(linked.pose && samePose(linked.pose, pose, WALK.radius));
        near(linked.pose.eye, pose.eye, 1e-5);
        assert.equal(linked.distance, 3.25);
        const back = { ...DEFAULTS, ...linked.values };
        if (values.range && back.range) {
            assert.ok(Math.abs(back.range[0] - values.range[0]) < 1e-5);
            back.range = values.range;
        }
        assert.deepEqual(back, values);
    }
});

test("what is not a link is left out, and what is left of one is used", () => {
    for (const hash of [
        "",
        "#",
        "#eye",
        "#eye=1,2&forward=0,0,0",
        "#%",
        "#eye=a,b,c&forward=0,0,1",
        "#range=5,1",
        "#fov=NaN",
    ]) {
        const linked = parse(WALK, hash);
        assert.equal(linked.pose, null, hash);
        assert.deepEqual(linked.values, {}, hash);
    }
    const half = parse(WALK, "#eye=512000,40,-9000&forward=0,0,-2&fov=1e9&tone=shiny&cells=1&exposure=1e99&range=0,");
    assert.deepEqual(half.pose?.forward, [0, 0, -1]);
    assert.deepEqual(half.pose?.eye, [0, 0, 0]);
    assert.deepEqual(half.values, { cells: true });
    assert.equal(parse(WALK, "#eye=Infinity,0,0&forward=0,0,1").pose, null);
});

test("settings tell only of what is new", () => {
    const settings = new Settings({ curve: "aces" });
    /** @type {Partial<Values>[]} */
    const heard = [];
    settings.listen((_values, changed) => heard.push(changed));
    settings.set({ curve: "aces", range: null });
    settings.set({ range: [1, 2] });
    settings.set({ range: [1, 2], cells: true });
    assert.deepEqual(heard.slice(1), [{ range: [1, 2] }, { cells: true }]);
});

test("colour maps meet those that they are fits of", () => {
    const turbo = colourTable("turbo");
    const viridis = colourTable("viridis");
    /** @type {(table: Uint8Array, index: number) => Vec3} */
    const at = (table, i) => [table[4 * i], table[4 * i + 1], table[4 * i + 2]];
    // From the published tables: Mikhailov 2019 and matplotlib. The polynomials smooth out the corners of turbo.
    near(at(turbo, 128), [164, 252, 60], 25);
    near(at(viridis, 0), [68, 1, 84], 4);
    near(at(viridis, 128), [33, 145, 140], 4);
    near(at(viridis, 255), [253, 231, 37], 6);
    assert.equal(turbo.length, 1024);
    const lightness = Array.from({ length: 256 }, (_, i) => dot(at(viridis, i), [0.2126, 0.7152, 0.0722]));
    assert.ok(lightness.every((l, i) => i === 0 || l > lightness[i - 1] - 0.5));
    const hump = Array.from({ length: 256 }, (_, i) => dot(at(turbo, i), [0.2126, 0.7152, 0.0722]));
    const top = hump.indexOf(Math.max(...hump));
    assert.ok(hump.every((l, i) => i === 0 || (i <= top ? l > hump[i - 1] - 1 : l < hump[i - 1] + 1)));
});

test("numbers read as in a report", () => {
    assert.equal(number(1234.5), "1,230");
    assert.equal(number(0.01234), "0.0123");
    assert.equal(number(-3.456), "−3.46");
    assert.equal(number(0), "0");
    assert.equal(number(NaN), "–");
    assert.equal(number(1.234e12), "1.23 × 10¹²");
    assert.equal(number(5e-7), "5.00 × 10⁻⁷");
    assert.equal(percent(0.02134), "2.1 %");
    assert.equal(plusMinus(NaN), "");
    assert.equal(plusMinus(0.5), "± 50 %");
    assert.equal(count(78443), "78.4 k");
    assert.equal(count(5e6), "5 M");
    assert.equal(count(9123), "9,123");
    assert.equal(duration(3725), "1 h 02 min");
    assert.equal(duration(61.2), "1 min 01 s");
    assert.equal(stops(-1.25), "−1.3 EV");
    assert.equal(stops(-0.001), "+0.0 EV");
});

test("numbers are read as people type them", () => {
    for (const [text, value] of /** @type {[string, number][]} */ ([
        ["500", 500],
        [" 1,200 lx", 1200],
        ["0,5", 0.5],
        ["0.125", 0.125],
        ["0,125", 0.125],
        ["1 200", 1200],
        ["12,5 W/m²", 12.5],
        ["1e3", 1000],
        ["", NaN],
        ["many", NaN],
    ])) {
        assert.equal(parseNumber(text), value, text);
    }
});

test("ticks are few, in order, round, and the ends are among them", () => {
    for (const logarithmic of [false, true]) {
        for (const [low, high] of [
            [60, 870],
            [0.013, 900_000],
            [1, 10],
            [100, 101],
            [3e-9, 7e-9],
            [0, 500],
            [500, 500],
        ]) {
            const found = ticks({ low, high, logarithmic });
            if (high === low || (logarithmic && low === 0)) {
                assert.deepEqual(found, []);
                continue;
            }
            assert.ok(found.length >= 2 && found.length <= 8, `${found.length} ticks from ${low} to ${high}`);
            assert.ok(found.every(({ at }, i) => at >= 0 && at <= 1 && (i === 0 || at > found[i - 1].at)));
        }
    }
    const labels = ticks({ low: 0, high: 500, logarithmic: false }).map(({ text }) => text);
    assert.deepEqual(labels, ["0", "100", "200", "300", "400", "500"]);
});

test("half the error is a quarter of the way", () => {
    /** @type {import("twinray/types.js").Status} */
    const status = { state: "solving", rays: 50, rate: 1, error: 0.04, seconds: 1, goal: { error: 0.02 } };
    assert.equal(done(status), 0.25);
    assert.equal(done({ ...status, goal: { rays: 200 } }), 0.25);
    assert.equal(done({ ...status, goal: null }), null);
    assert.equal(done({ ...status, error: NaN }), 0);
});

test("a scene's name makes a file's", () => {
    assert.equal(fileName("Hall: east/west"), "Hall- east-west");
    assert.equal(fileName("../"), "scene");
});
