#include "pbm_scan/images/files_beside.h"

#include "pbm_scan/text/encoding.h"
#include "system/files/file_names.h"
#include "system/utf8.h"

#include <algorithm>
#include <array>
#include <filesystem>
#include <system_error>

namespace pbm::build {
namespace {

namespace fs = std::filesystem;

fs::path slashed(std::string_view name) {
    std::string slashed(name);
    std::replace(slashed.begin(), slashed.end(), '\\', '/');
    return slashed;
}

bool is_file(const fs::path &path) {
    std::error_code ignored;
    return fs::is_regular_file(path, ignored);
}

// Letters and those with the mark: "AÀ" stands for A + mark = À.
struct Mark {
    char32_t mark;
    std::u32string_view pairs;
};
// Based on: The Unicode Consortium. Unicode Standard Annex 15, Unicode Normalization Forms (form C). 2021. Marks of
// Latin, Cyrillic and Japanese letters.
constexpr std::array<Mark, 13> kMarks{{{0x300, U"AÀEÈIÌOÒUÙaàeèiìoòuù"},
                                       {0x301, U"AÁEÉIÍOÓUÚYÝaáeéiíoóuúyýCĆcćLĹlĺNŃnńRŔrŕSŚsśZŹzź"},
                                       {0x302, U"AÂEÊIÎOÔUÛaâeêiîoôuûCĈcĉGĜgĝHĤhĥJĴjĵSŜsŝWŴwŵYŶyŷ"},
                                       {0x303, U"AÃNÑOÕaãnñoõIĨiĩUŨuũ"},
                                       {0x304, U"AĀaāEĒeēIĪiīOŌoōUŪuū"},
                                       {0x306, U"AĂaăEĔeĕGĞgğIĬiĭOŎoŏUŬuŭИЙий"},
                                       {0x307, U"CĊcċEĖeėGĠgġIİZŻzż"},
                                       {0x308, U"AÄEËIÏOÖUÜaäeëiïoöuüyÿYŸЕЁеёІЇії"},
                                       {0x30A, U"AÅaåUŮuů"},
                                       {0x30B, U"OŐoőUŰuű"},
                                       {0x30C, U"CČcčDĎdďEĚeěNŇnňRŘrřSŠsšTŤtťZŽzžLĽlľ"},
                                       {0x327, U"CÇcçGĢKĶkķLĻlļNŅnņRŖrŗSŞsşTŢtţ"},
                                       {0x328, U"AĄaąEĘeęIĮiįUŲuų"}}};

// The one character for a letter and the mark behind it; 0: there is none.
char32_t composed(char32_t letter, char32_t mark) {
    constexpr char32_t kVoiced = 0x3099, kHalfVoiced = 0x309A, kFirstKana = 0x3041, kLastKana = 0x30FF;
    if ((mark == kVoiced || mark == kHalfVoiced) && letter >= kFirstKana && letter <= kLastKana)
        return letter + (mark == kVoiced ? 1 : 2);
    constexpr char32_t kLead = 0x1100, kVowel = 0x1161, kTail = 0x11A7, kSyllable = 0xAC00; // Hangul
    if (letter - kLead < 19 && mark - kVowel < 21)
        return kSyllable + ((letter - kLead) * 21 + (mark - kVowel)) * 28;
    if (letter - kSyllable < 11172 && (letter - kSyllable) % 28 == 0 && mark - kTail - 1 < 27)
        return letter + (mark - kTail);
    for (const Mark &known : kMarks)
        for (std::size_t i = 0; known.mark == mark && i < known.pairs.size(); i += 2)
            if (known.pairs[i] == letter)
                return known.pairs[i + 1];
    return 0;
}

// The entry of `folder` with this folded name; the first in the order of names if there are several.
std::optional<fs::path> entry_of(const fs::path &folder, const std::string &name) {
    const std::string wanted = folded_file_name(name);
    std::optional<fs::path> found;
    std::error_code error;
    for (fs::directory_iterator each(folder.empty() ? "." : folder, error), end; !error && each != end;
         each.increment(error)) {
        const std::string entry = each->path().filename().string();
        if (folded_file_name(entry) == wanted && (!found || entry < found->filename().string()))
            found = folder / entry;
    }
    return found;
}

std::optional<fs::path> in_any_spelling(fs::path folder, const fs::path &name) {
    for (const fs::path &part : name) {
        std::error_code ignored;
        if (part == "." || part == ".." || fs::exists(folder / part, ignored)) {
            folder /= part;
            continue;
        }
        const auto entry = entry_of(folder, part.string());
        if (!entry)
            return std::nullopt;
        folder = *entry;
    }
    return is_file(folder) ? std::optional(folder) : std::nullopt;
}

std::optional<std::string> find_named(const std::string &scan, std::string_view name) {
    const fs::path folder = fs::path(scan).parent_path(), path = slashed(name);
    if (path.empty() || name.find('\0') != std::string_view::npos)
        return std::nullopt;
    if (is_file(folder / path))
        return (folder / path).string();
    if (path.is_relative())
        if (const auto found = in_any_spelling(folder, path))
            return found->string();
    if (const auto found = in_any_spelling(folder, path.filename()))
        return found->string();
    return std::nullopt;
}

} // namespace

std::optional<std::string> find_beside(const std::string &scan, std::string_view name) {
    if (auto found = find_named(scan, name))
        return found;
    const bool is_quoted =
        name.size() > 2 && (name.front() == '"' || name.front() == '\'') && name.back() == name.front();
    return is_quoted ? find_named(scan, name.substr(1, name.size() - 2)) : std::nullopt;
}

std::string why_missing(std::string_view name) {
    return name.find("<UDIM>") == std::string_view::npos
               ? "there is no such file"
               : "a name for many images, a tile each (UDIM): bake them into one image";
}

std::string folded_file_name(std::string_view name) {
    std::u32string characters;
    const auto add = [&](char32_t code) {
        const char32_t both = characters.empty() ? 0 : composed(characters.back(), code);
        if (both != 0)
            characters.back() = both;
        else
            characters.push_back(code);
    };
    for (std::string_view rest = name; !rest.empty();) {
        const Utf8Character next = utf8_character(rest);
        add(next.bytes != 0 ? next.code : static_cast<unsigned char>(rest.front()));
        rest.remove_prefix(std::max<std::size_t>(next.bytes, 1));
    }
    std::string folded;
    for (const char32_t code : characters)
        append_utf8(code < 0x80 ? static_cast<unsigned char>(lower_case(static_cast<char>(code))) : code, folded);
    return folded;
}

NamedFile name_beside(const std::string &scan, std::string_view name) {
    return {std::string(name), find_beside(scan, name).value_or(""),
            (fs::path(scan).parent_path() / slashed(name)).string()};
}

} // namespace pbm::build
