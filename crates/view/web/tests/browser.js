/**
 * Chromium for tests, without a window and with WebGL in software, and pages of it that fail a test for anything they complain of.
 * `CHROMIUM` names another binary.
 */

import { existsSync } from "node:fs";

import puppeteer from "puppeteer-core";

import { serve } from "./serve.js";

/** @import { Browser, Page } from "puppeteer-core" */
/** @typedef {{ width?: number, height?: number, touch?: boolean, query?: string, hash?: string, still?: boolean }} Window */

const BINARY =
    process.env.CHROMIUM ??
    ["/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"].find(existsSync);

export async function launch() {
    const server = await serve();
    const chromium = await browser();
    const close = async () => {
        await chromium.close();
        server.close();
    };
    return { browser: chromium, url: server.url, close };
}

/** A browser without a page. */
export async function browser() {
    if (!BINARY) throw new Error("no chromium found; name one in CHROMIUM");
    return puppeteer.launch({
        executablePath: BINARY,
        headless: true,
        args: [
            // Tests in a container run as root, for whom Chromium has no sandbox.
            ...(process.getuid?.() === 0 ? ["--no-sandbox"] : []),
            "--use-angle=swiftshader",
            "--enable-unsafe-swiftshader",
            "--ignore-gpu-blocklist",
        ],
    });
}

/**
 * A page that is ready, and the list of what it has complained of.
 * @param {{ browser: Browser, url: string }} launched
 * @param {Window} window
 * @returns {Promise<{ page: Page, complaints: string[] }>}
 */
export async function open(
    { browser, url },
    { width = 1280, height = 800, touch = false, query = "", hash = "", still } = {},
) {
    const page = await browser.newPage();
    /** @type {string[]} */
    const complaints = [];
    page.on("console", (message) => ["error", "warn"].includes(message.type()) && complaints.push(message.text()));
    page.on("pageerror", (error) => complaints.push(String(error)));
    page.on(
        "response",
        (response) => response.status() >= 400 && complaints.push(`${response.status()} ${response.url()}`),
    );
    page.on("request", (request) => {
        if (!/^(data|blob):/.test(request.url()) && !request.url().startsWith(url))
            complaints.push(`asks for ${request.url()}`);
    });
    await page.setViewport({ width, height, hasTouch: touch, isMobile: touch });
    // Movement that takes its time is tested where it is meant to.
    if (still) await page.emulateMediaFeatures([{ name: "prefers-reduced-motion", value: "reduce" }]);
    await page.goto(`${url}${query}${hash}`);
    await page.waitForFunction("document.body.dataset.page !== 'loading'");
    await page.waitForFunction("window.twinray || document.body.dataset.page === 'failed'");
    return { page, complaints };
}

/** @param {number} milliseconds */
export const wait = (milliseconds) => new Promise((resolve) => setTimeout(resolve, milliseconds));
