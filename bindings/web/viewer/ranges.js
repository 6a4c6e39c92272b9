// Plans requests. Ranges are [from, to], `to` not included.

// A gap of fewer bytes than this is fetched too: a request of its own costs more.
const BRIDGED = 16 * 1024;
// A request that still lacks no more than this is not cancelled: closing its connection costs more.
const NEARLY_DONE = 64 * 1024;

// Joins ranges that overlap or nearly touch. The result is in the order of the file, which is from coarse to fine.
export function joined(ranges, bridged = BRIDGED) {
    const result = [];
    for (const [from, to] of [...ranges].sort((a, b) => a[0] - b[0])) {
        const last = result.at(-1);
        if (last && from - last[1] < bridged) last[1] = Math.max(last[1], to);
        else result.push([from, to]);
    }
    return result;
}

// Removes from `ranges` what `covered` (any order) holds already.
export function without(ranges, covered) {
    let left = ranges.map((range) => [...range]);
    for (const [from, to] of covered) {
        left = left.flatMap(([a, b]) =>
            to <= a || from >= b
                ? [[a, b]]
                : [
                      [a, from],
                      [to, b],
                  ].filter(([x, y]) => x < y),
        );
    }
    return left;
}

// What to do about requests that run ([{at, to}]: the bytes from `at` on are still to come), given what is wanted now.
// Returns the requests to cancel and the ranges to request, most urgent first.
export function plan(wanted, running) {
    const needed = ([from, to]) => wanted.some(([a, b]) => a < to && from < b);
    const cancelled = running.filter(({ at, to }) => to - at > NEARLY_DONE && !needed([at, to]));
    const kept = running.filter((request) => !cancelled.includes(request)).map(({ at, to }) => [at, to]);
    const fresh = joined(without(wanted, kept));
    // Bridged gaps may cover what a kept request brings.
    const requests = without(fresh, kept);
    const urgency = ([from, to]) => wanted.findIndex(([a, b]) => a < to && from < b);
    return { cancelled, requests: requests.sort((a, b) => urgency(a) - urgency(b)) };
}
