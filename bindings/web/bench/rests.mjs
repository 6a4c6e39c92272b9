// How soon a view in Chromium is fine when a drag ends: rests.mjs MODEL.pbvg
//
// Milliseconds from the last move of the pointer to the fast picture in full resolution, to a fine sample, and to all of
// them: medians of DRAGS, after one that is not counted. 1280x720, quality "auto", threads as the page gets them.
import { basename, dirname, resolve } from "node:path";
import { atRest, start } from "../tests/browser.mjs";

const DRAGS = 9,
    MOVES = 20,
    SIZE = { width: 1280, height: 720 };

const [model] = process.argv.slice(2);
if (model === undefined) {
    console.error("usage: rests.mjs MODEL.pbvg");
    process.exit(1);
}

// Runs in the page: the times after the last move at which the worker tells of each picture.
async function timesOfPictures() {
    const viewer = document.getElementById("viewer");
    const times = {};
    for (;;) {
        const { scale, samples, resting } = await viewer.statistics();
        const time = performance.now() - window.lastMove;
        if (scale === 1) times.exact ??= time;
        if (samples > 0) times.sample ??= time;
        if (samples > 1 || resting) return { ...times, all: time };
    }
}

const median = (values) => values.toSorted((a, b) => a - b)[values.length >> 1];

const shop = await start({ models: [dirname(resolve(model))], isolated: true });
try {
    const page = await shop.open(
        `<style>#viewer { width: ${SIZE.width}px; height: ${SIZE.height}px }</style>
         <pbm-viewer id="viewer" src="${basename(model)}" controls background="#333"></pbm-viewer>`,
        { viewport: SIZE },
    );
    await page.evaluate(() => addEventListener("pointermove", () => (window.lastMove = performance.now()), true));
    const drags = [];
    for (let drag = 0; drag <= DRAGS; ++drag) {
        await page.mouse.move(SIZE.width / 2, SIZE.height / 2);
        await page.mouse.down();
        for (let move = 1; move <= MOVES; ++move) await page.mouse.move(SIZE.width / 2 + 6 * move, SIZE.height / 2);
        drags.push(await page.evaluate(timesOfPictures));
        await page.mouse.up();
        await atRest(page);
    }
    const { threads } = await page.evaluate(() => document.getElementById("viewer").statistics());
    const of = (kind) => Math.round(median(drags.slice(1).map((times) => times[kind])));
    console.log(`${threads} threads: fast ${of("exact")} ms, a fine sample ${of("sample")} ms, all ${of("all")} ms`);
} finally {
    await shop.close();
}
