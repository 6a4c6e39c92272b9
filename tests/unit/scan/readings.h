// What a reader of scans makes of a file in a string.
#pragma once

#include "pbm_scan/surface_reader.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>

namespace pbm::test {

using build::AttributeReport;
using Fate = AttributeReport::Fate;

inline std::span<const std::uint8_t> bytes_of(const std::string &text) {
    return {reinterpret_cast<const std::uint8_t *>(text.data()), text.size()};
}

// The bytes of a number, as a file of this machine's order has them.
template <class T> std::string raw(T value) { return {reinterpret_cast<const char *>(&value), sizeof value}; }

// The results of read_ply and the like.
template <Result<build::Surface> (*Read)(std::span<const std::uint8_t>, const build::ReadOptions &)> struct Reading {
    static build::Surface surface(const std::string &file) {
        Result<build::Surface> result = Read(bytes_of(file), {});
        EXPECT_TRUE(result.ok()) << (result.ok() ? "" : result.error().message);
        return result.ok() ? std::move(*result) : build::Surface{};
    }
    static Error error(const std::string &file, const build::ReadOptions &options = {}) {
        const Result<build::Surface> result = Read(bytes_of(file), options);
        EXPECT_FALSE(result.ok());
        return result.ok() ? Error{} : result.error();
    }
    static std::string message(const std::string &file) { return error(file).message; }
};

// A file whose name is that of its format, or any name where the bytes identify it.
inline Result<build::Surface> read(const std::string &file, std::string_view name,
                                   const build::ReadOptions &options = {}) {
    return build::read_surface(bytes_of(file), name, options);
}
inline build::Surface surface(const std::string &file, std::string_view name, const build::ReadOptions &options = {}) {
    Result<build::Surface> result = read(file, name, options);
    EXPECT_TRUE(result.ok()) << file << (result.ok() ? "" : result.error().message);
    return result.ok() ? std::move(*result) : build::Surface{};
}
inline Error error(const std::string &file, std::string_view name) {
    const Result<build::Surface> result = read(file, name);
    EXPECT_FALSE(result.ok()) << file;
    return result.ok() ? Error{} : result.error();
}

// The first line of the report whose name begins with `name`, or an empty one.
inline AttributeReport report(const build::Surface &s, std::string_view name) {
    for (const AttributeReport &line : s.report)
        if (line.name.substr(0, name.size()) == name)
            return line;
    return {};
}

// The first line of the report in whose name `word` is a word, or an empty one.
inline AttributeReport report_of(const build::Surface &s, const std::string &word) {
    for (const AttributeReport &line : s.report)
        if ((" " + line.name + " ").find(" " + word + " ") != std::string::npos ||
            (line.name + " ").find("." + word + " ") != std::string::npos)
            return line;
    return {};
}

// The note of the line of this name.
inline std::string note_of(const build::Surface &s, const std::string &name) {
    for (const AttributeReport &line : s.report)
        if (line.name == name)
            return line.note;
    return "no such line";
}

inline bool has(const std::string &text, std::string_view part) { return text.find(part) != std::string::npos; }

// Whether a line has `name` in its name, and this fate.
inline bool reports(const build::Surface &s, std::string_view name, Fate fate) {
    return std::any_of(s.report.begin(), s.report.end(),
                       [&](const AttributeReport &line) { return has(line.name, name) && line.fate == fate; });
}

} // namespace pbm::test
