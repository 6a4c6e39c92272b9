// Verdicts and findings are those of pbm-validate.
import assert from "node:assert/strict";
import path from "node:path";
import { test } from "node:test";
import { bytesOf, CODES, loadValidator, modelsOf, PbmError, SOURCE, validateNatively } from "./native.mjs";

const validator = await loadValidator();

for (const folder of ["vectors/valid", "vectors/invalid", "vectors/advised", "golden"])
    test(`the verdicts of ${folder}`, () => {
        const files = modelsOf(folder),
            reports = validateNatively(files, ["--deep", "--max-findings", "100"]);
        assert.ok(files.length > 5);
        assert.equal(reports.length, files.length);
        files.forEach((file, i) => {
            const { verdict, errors, warnings, infos, points, findings } = validator.validate(bytesOf(file), {
                level: "deep",
            });
            const expected = reports[i],
                name = path.basename(file);
            assert.equal(path.basename(expected.file), name);
            assert.deepEqual(
                { verdict, errors, warnings, infos, points },
                {
                    verdict: expected.exit_code,
                    errors: expected.errors,
                    warnings: expected.warnings,
                    infos: expected.infos,
                    points: expected.points,
                },
                name,
            );
            const what = ({ severity, offset, rule = "", section, message, remedy }) => ({
                severity,
                offset,
                rule,
                section,
                message,
                remedy,
            });
            assert.deepEqual(
                findings.map((found) => ({ name: found.name, ...what(found) })),
                expected.findings.map((found) => ({ name: found.code, ...what(found) })),
                name,
            );
        });
    });

test("quick verdicts see the header alone", () => {
    const bytes = bytesOf(path.join(SOURCE, "format_spec/golden/1.0/scan-plain.pbvg"));
    bytes[bytes.length - 100] ^= 1;
    assert.equal(validator.validate(bytes, { level: "quick" }).verdict, CODES.OK);
    assert.equal(validator.validate(bytes).verdict, CODES.INVALID);
    assert.equal(validator.validate(bytes, { maxFindings: 1 }).findings.length, 1);
    bytes[0] ^= 1;
    assert.equal(validator.validate(bytes, { level: "quick" }).verdict, CODES.INVALID);
    assert.equal(validator.validate(new Uint8Array(0)).verdict, CODES.INVALID);
});

test("wrong calls are refused", () => {
    for (const call of [
        () => validator.validate("text"),
        () => validator.validate(new Uint8Array(10), { level: "all" }),
    ])
        assert.throws(call, (error) => error instanceof PbmError && error.code === CODES.USAGE);
});
