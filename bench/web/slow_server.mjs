// A web server at the end of a slow line: all connections share `rate` bytes a second, and every request and every new
// connection waits `delay` ms. Answers ranges. `log` holds {path, start, end, bytes: [[time, bytes]]}, times of
// performance.now().
import { createServer } from "node:http";
import { readFileSync, statSync } from "node:fs";
import { extname, join, normalize } from "node:path";
import { gzipSync } from "node:zlib";
import { setTimeout as sleep } from "node:timers/promises";

const TYPES = { ".html": "text/html", ".js": "text/javascript", ".wasm": "application/wasm", ".jpg": "image/jpeg" };
const STEP = 4096; // bytes

export async function startSlowServer(folders, { rate, delay }) {
    const server = { log: [] };
    const seen = new Set(); // connections
    let free = 0; // when the line is
    const turn = async (bytes) => {
        free = Math.max(free, performance.now()) + bytes / rate * 1000;
        const wait = free - performance.now();
        if (wait > 1) await sleep(wait);
    };
    const compressed = new Map();
    const http = createServer(async (request, response) => {
        const path = new URL(request.url, "http://server").pathname;
        const file = folders.map((folder) => join(folder, normalize(path))).find((name) =>
            statSync(name, { throwIfNoEntry: false })?.isFile());
        const entry = { path, start: performance.now(), end: Infinity, bytes: [] };
        server.log.push(entry);
        await sleep(seen.has(request.socket) ? delay : 2 * delay);
        seen.add(request.socket);
        if (!file) return response.writeHead(404).end();
        const headers = { "Content-Type": TYPES[extname(file)] ?? "application/octet-stream", "Cache-Control": "no-store",
            "Accept-Ranges": "bytes" };
        let status = 200;
        let body = readFileSync(file);
        const range = /^bytes=(\d+)-(\d*)$/.exec(request.headers.range ?? "");
        if (range) {
            const to = Math.min(range[2] === "" ? body.length : +range[2] + 1, body.length);
            headers["Content-Range"] = `bytes ${range[1]}-${to - 1}/${body.length}`;
            body = body.subarray(+range[1], to);
            status = 206;
        } else if ([".html", ".js", ".wasm"].includes(extname(file))) {
            if (!compressed.has(file)) compressed.set(file, gzipSync(body, { level: 9 }));
            body = compressed.get(file);
            headers["Content-Encoding"] = "gzip";
        }
        response.writeHead(status, { ...headers, "Content-Length": body.length });
        for (let at = 0; at < body.length && !response.destroyed; at += STEP) {
            const part = body.subarray(at, at + STEP);
            await turn(part.length);
            response.write(part);
            entry.bytes.push([performance.now(), part.length]);
        }
        response.end();
        entry.end = performance.now();
    });
    await new Promise((resolve) => http.listen(0, "127.0.0.1", resolve));
    server.url = `http://127.0.0.1:${http.address().port}`;
    server.close = () => http.closeAllConnections() ?? http.close();
    // Bytes of files whose path `counts` accepts, sent before a time.
    server.sent = (counts, before = Infinity) => server.log.filter(({ path }) => counts(path))
        .flatMap(({ bytes }) => bytes).reduce((sum, [time, size]) => sum + (time <= before ? size : 0), 0);
    return server;
}
