// What JavaScript does for WebAssembly: reading and reporting, which pbm.js hands to each module, and numbers.cpp.
mergeInto(LibraryManager.library, {
    pbm_web_read__sig: "iijji",
    pbm_web_read: function (context, offset, size, to) {
        return Module["pbmRead"](context, offset, size, to);
    },
    pbm_web_report__sig: "iii",
    pbm_web_report: function (context, finding) {
        return Module["pbmReport"](context, finding);
    },
    pbm_web_power__sig: "ddd",
    pbm_web_power: function (base, exponent) {
        return Math.pow(base, exponent);
    },
    pbm_web_logarithm__sig: "dd",
    pbm_web_logarithm: function (number) {
        return Math.log(number);
    },
    pbm_web_number__sig: "dii",
    pbm_web_number: function (text, length) {
        var digits = "";
        while (HEAPU8[text + digits.length]) digits += String.fromCharCode(HEAPU8[text + digits.length]);
        HEAP32[length >> 2] = digits.length;
        return Number(digits);
    },
    // A number as printf's "%.*g" prints it; for no digits the shortest text, with a power of ten only if it is shorter.
    pbm_web_print__sig: "idii",
    pbm_web_print: function (number, count, text) {
        var size = Math.abs(number);
        function parts(places) {
            var found = /^(\d)\.?(\d*)e(.*)$/.exec(size.toExponential(places));
            return { digits: found[1] + found[2], exponent: Number(found[3]) };
        }
        function plain(digits, exponent) {
            if (exponent < 0) return "0." + "0".repeat(-1 - exponent) + digits;
            if (digits.length <= exponent + 1) return count ? digits.padEnd(exponent + 1, "0") : String(BigInt(size));
            return digits.slice(0, exponent + 1) + "." + digits.slice(exponent + 1);
        }
        function scientific(digits, exponent) {
            var point = digits.length > 1 ? "." : "",
                sign = exponent < 0 ? "e-" : "e+";
            return digits[0] + point + digits.slice(1) + sign + String(Math.abs(exponent)).padStart(2, "0");
        }
        var rounded = count ? parts(count - 1) : parts(),
            exact = parts(100); // no half has more digits
        if (count && exact.digits[count - 1] % 2 === 0 && /^50*$/.test(exact.digits.slice(count)))
            rounded = { digits: exact.digits.slice(0, count), exponent: exact.exponent }; // halves are rounded to even
        var digits = rounded.digits.replace(/0+$/, "") || "0",
            texts = [plain(digits, rounded.exponent), scientific(digits, rounded.exponent)];
        var isPlain = count ? rounded.exponent >= -4 && rounded.exponent < count : texts[0].length <= texts[1].length;
        var result = (number < 0 || Object.is(number, -0) ? "-" : "") + texts[isPlain ? 0 : 1];
        for (var i = 0; i < result.length; ++i) HEAPU8[text + i] = result.charCodeAt(i);
        return result.length;
    },
});
