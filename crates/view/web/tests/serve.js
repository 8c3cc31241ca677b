/**
 * Serves the page for tests and development: the modules of this folder, with the stand-ins of `tests/standin` for those that
 * need a scene. Run by itself it says where to look. `?export` in the address gives the page as an exported file has it.
 */

import { readdirSync, readFileSync } from "node:fs";
import { createServer } from "node:http";
import { dirname, join } from "node:path";
import { fileURLToPath } from "node:url";

const TESTS = dirname(fileURLToPath(import.meta.url));
const WEB = dirname(TESTS);
const STANDINS = join(TESTS, "standin");

/** What the server of `twinray view` sends with a page; data addresses are those of an exported file. */
const POLICY =
    "default-src 'none'; script-src 'self' 'unsafe-inline' data:; style-src 'self' 'unsafe-inline'; " +
    "img-src 'self' data: blob:; connect-src 'self'; base-uri 'none'; form-action 'none'";

/** Module name to file. @returns {Map<string, string>} */
function modules() {
    const found = new Map();
    for (const folder of [WEB, STANDINS]) {
        for (const name of readdirSync(folder)) if (name.endsWith(".js")) found.set(name, join(folder, name));
    }
    return found;
}

/** @param {boolean} exported */
export function page(exported) {
    const imports = Object.fromEntries(
        [...modules()].map(([name, file]) => [
            `twinray/${name}`,
            exported ? `data:text/javascript;base64,${readFileSync(file).toString("base64")}` : `./${name}`,
        ]),
    );
    const style = readFileSync(join(WEB, "style.css"), "utf8");
    return readFileSync(join(WEB, "index.html"), "utf8")
        .replace("<!-- style -->", () =>
            exported ? `<style>${style}</style>` : '<link rel="stylesheet" href="style.css">',
        )
        .replace("<!-- importmap -->", () => `<script type="importmap">${JSON.stringify({ imports })}</script>`)
        .replace("<!-- walk -->", () =>
            exported ? '<script type="application/octet-stream;base64" id="walk">AAAA</script>' : "",
        );
}

/** @returns {Promise<{ url: string, close: () => void }>} */
export function serve(port = 0) {
    const files = modules();
    const server = createServer((request, response) => {
        const url = new URL(request.url ?? "/", "http://localhost");
        const name = url.pathname.slice(1);
        /** @type {(type: string, body: string | Buffer) => void} */
        const send = (type, body) => {
            response.writeHead(200, { "content-type": type, "content-security-policy": POLICY });
            response.end(body);
        };
        const file = files.get(name);
        if (name === "") send("text/html", page(url.searchParams.has("export")));
        else if (name === "style.css") send("text/css", readFileSync(join(WEB, name)));
        else if (file) send("text/javascript", readFileSync(file));
        else response.writeHead(404).end();
    });
    return new Promise((resolve) => {
        server.listen(port, "127.0.0.1", () => {
            const address = server.address();
            const at = typeof address === "object" && address ? address.port : port;
            resolve({ url: `http://127.0.0.1:${at}/`, close: () => server.close() });
        });
    });
}

if (process.argv[1] === fileURLToPath(import.meta.url)) {
    const { url } = await serve(Number(process.argv[2] ?? 8000));
    console.log(url);
}
