// The page of the validator: takes a file, has a worker examine it, and shows what was found.
import { trusted } from "../viewer/addresses.js";

const MOST_FINDINGS = 1000;
const LARGEST = 1.5e9; // bytes of a file: it is examined in memory
const SEVERITIES = ["info", "warning", "error"];
const byId = (id) => document.getElementById(id);
const [drop, file, state, result, verdict, counts, findings] = [
    "drop",
    "file",
    "state",
    "result",
    "verdict",
    "counts",
    "findings",
].map(byId);
const number = (value) => Number(value).toLocaleString("en");
const count = (value, what) => `${number(value)} ${what}${Number(value) === 1 ? "" : "s"}`;

let worker = null;
let examined = null; // the file that was chosen last

// A worker that keeps to a policy: that which the server sends with its file, or else that of this page, which a worker made
// of a Blob inherits. Policies of servers seldom allow the latter.
async function newWorker() {
    const file = new URL("./validator_worker.js", import.meta.url);
    const { headers } = await fetch(file, { method: "HEAD" });
    if (headers.has("content-security-policy")) return new Worker(trusted(file), { type: "module" });
    const text = `import ${JSON.stringify(file.href)};`;
    const address = URL.createObjectURL(new Blob([text], { type: "text/javascript" }));
    return new Worker(trusted(address), { type: "module" });
}

async function examine(chosen) {
    worker?.terminate();
    examined = chosen;
    result.hidden = true;
    if (chosen.size > LARGEST) {
        state.textContent = `${chosen.name} has more bytes than this page can examine: run pbm-validate.`;
        return;
    }
    state.textContent = `${chosen.name} is being examined.`;
    const fresh = await newWorker();
    if (chosen !== examined) return fresh.terminate(); // another file was chosen meanwhile
    worker = fresh;
    worker.onmessage = ({ data }) => {
        if (data === "ready") worker.postMessage({ file: chosen, level: "deep", maxFindings: MOST_FINDINGS });
        else show(chosen, data);
    };
    worker.onerror = () => {
        state.textContent = "The validator cannot run: are all files of the package on the server?";
    };
}

function show(chosen, { report, message }) {
    state.textContent = message ? `${chosen.name} cannot be examined: ${message}` : "";
    result.hidden = !report;
    if (!report) return;
    const valid = report.verdict === 0;
    verdict.textContent = `${chosen.name} is ${valid ? "valid" : "not valid"}`;
    verdict.className = valid ? "valid" : "invalid";
    counts.textContent =
        `${count(chosen.size, "byte")}, ${count(report.points, "point")} verified; ` +
        `${count(report.errors, "error")}, ${count(report.warnings, "warning")}, ${count(report.infos, "note")}` +
        (report.findings.length < report.errors + report.warnings + report.infos
            ? `; the first ${number(report.findings.length)} are listed`
            : "");
    findings.hidden = report.findings.length === 0;
    findings.tBodies[0].replaceChildren(...report.findings.map(row));
}

function row({ severity, name, rule, offset, section, message, remedy }) {
    const level = typeof severity === "number" ? SEVERITIES[severity] : severity;
    const line = document.createElement("tr");
    line.className = level;
    const link = Object.assign(document.createElement("a"), {
        href: `validator-codes.html#${name}`,
        textContent: name,
    });
    // Messages begin with the rule, which has a column of its own.
    const text = rule && message.startsWith(`${rule} `) ? message.slice(rule.length + 1) : message;
    for (const content of [level, link, rule, offset === null ? "" : number(offset), section, text, remedy])
        line.insertCell().append(content);
    return line;
}

file.addEventListener("change", () => file.files[0] && examine(file.files[0]));
for (const name of ["dragover", "dragleave", "drop"]) {
    document.addEventListener(name, (event) => {
        event.preventDefault();
        drop.classList.toggle("over", name === "dragover");
        if (name === "drop" && event.dataTransfer.files[0]) examine(event.dataTransfer.files[0]);
    });
}
