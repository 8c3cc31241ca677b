/**
 * The solver behind the page: its light goes to the renderer and its progress to the panel. Nobody else talks to it.
 */

import { toast } from "twinray/announce.js";
import { Live } from "twinray/live.js";
import { showStatus } from "twinray/progress.js";

/** @import { Readings } from "twinray/readings.js" */
/** @import { LiveLike, RendererLike, Status, Walk } from "twinray/types.js" */

/** Readings follow the light at most so often: numbers that flicker cannot be read. */
const REFRESH_MILLISECONDS = 1000;

export class Solve {
    /** @type {LiveLike} */
    live;
    /** @type {Status | null} */
    #status = null;
    #renderer;
    #readings;
    #refreshed = 0;

    /**
     * @param {Walk} walk
     * @param {RendererLike} renderer
     * @param {Readings} readings
     */
    constructor(walk, renderer, readings) {
        this.#renderer = renderer;
        this.#readings = readings;
        this.live = new Live(walk, { onLight: this.#onLight, onStatus: this.#onStatus });
    }

    /** Pauses a solve that runs, and resumes one that is paused. */
    async toggle() {
        try {
            if (this.#status?.state === "solving") await this.live.pause();
            else if (this.#status?.state === "paused") await this.live.resume();
        } catch (error) {
            toast(error instanceof Error ? error.message : String(error));
        }
    }

    #onLight = (/** @type {import("twinray/types.js").Container} */ light) => {
        this.#renderer.setLight(light);
        const now = performance.now();
        if (this.#readings.count === 0 || now - this.#refreshed < REFRESH_MILLISECONDS) return;
        this.#refreshed = now;
        this.#readings.refresh();
    };

    #onStatus = (/** @type {Status} */ status) => {
        const rests = status.state !== this.#status?.state && status.state !== "solving";
        this.#status = status;
        showStatus(status);
        // The last light may have come too soon after the one before.
        if (rests) this.#readings.refresh();
    };
}
