#include "pbm_scan/mesh/material_text.h"

#include "pbm_scan/conventions/colour_range.h"
#include "pbm_scan/conventions/reflectance.h"
#include "pbm_scan/text/text_lines.h"
#include "pbm_scan/text/text_number.h"
#include "pbm_scan/text/words.h"

#include <algorithm>
#include <array>
#include <cmath>

namespace pbm::build {
namespace {

// The numbers behind a statement's keyword; false if there are not `count` of them.
bool read_numbers(std::string_view words, std::span<double> numbers) {
    for (double &number : numbers) {
        words.remove_prefix(std::min(words.find_first_not_of(" \t"), words.size()));
        const std::size_t end = std::min(words.find_first_of(" \t"), words.size());
        if (!is_number(words.substr(0, end), number) || !std::isfinite(number))
            return false;
        words.remove_prefix(end);
    }
    return true;
}

// "-s 2 2 -clamp on skin of the cat.png". `dropped` gets the options that are not used.
MaterialImage read_image_statement(std::string_view words, bool is_relief, std::vector<std::string> &dropped) {
    struct Option {
        std::string_view name;
        std::size_t least, most; // numbers or words behind it
    };
    constexpr std::array<Option, 13> kOptions{{{"-blendu", 1, 1},
                                               {"-blendv", 1, 1},
                                               {"-cc", 1, 1},
                                               {"-clamp", 1, 1},
                                               {"-mm", 1, 2},
                                               {"-o", 1, 3},
                                               {"-s", 1, 3},
                                               {"-t", 1, 3},
                                               {"-texres", 1, 1},
                                               {"-boost", 1, 1},
                                               {"-bm", 1, 1},
                                               {"-imfchan", 1, 1},
                                               {"-type", 1, 1}}};
    MaterialImage image;
    while (true) {
        std::string_view rest = words;
        const std::string_view name = take_word(rest);
        const auto option =
            std::find_if(kOptions.begin(), kOptions.end(), [&](const Option &known) { return known.name == name; });
        if (option == kOptions.end())
            break;
        std::array<double, 3> numbers{};
        std::size_t count = 0;
        std::string_view word;
        for (; count < option->most; ++count) {
            std::string_view after = rest;
            const std::string_view next = take_word(after);
            double value = 0;
            if (count >= option->least && !is_number(next, value))
                break;
            is_number(next, value);
            numbers[count] = std::isfinite(value) ? value : 0;
            word = next;
            rest = after;
        }
        words = rest;
        // A missing number behind the first: -s is 1, -o is 0.
        if (name == "-s")
            image.scale = {numbers[0], count > 1 ? numbers[1] : 1.0};
        else if (name == "-o")
            image.offset = {numbers[0], numbers[1]};
        else if (name == "-clamp")
            image.is_clamped = word == "on";
        else if (name == "-bm" && is_relief)
            image.bump = static_cast<float>(std::clamp(numbers[0], -1000.0, 1000.0));
        else if (!name.starts_with("-blend") || word != "on") // as without the option
            dropped.emplace_back(name);
    }
    image.file = trimmed(words, " \t");
    return image;
}

// The image that a statement names; null: none that is used.
MaterialImage *image_of(std::string_view keyword, NamedMaterial &named) {
    if (keyword == "map_kd")
        return &named.image;
    if (keyword == "map_d" || keyword == "map_tr") {
        named.is_opacity_inverted = keyword == "map_tr";
        return &named.opacity_image;
    }
    if (keyword == "norm" || keyword == "map_norm")
        return &named.normal_image;
    if (keyword == "map_pr")
        return &named.roughness_image;
    if (keyword == "map_pm")
        return &named.metal_image;
    if (keyword == "map_ke" || keyword == "map_emissive")
        return &named.emission_image;
    return keyword == "bump" || keyword == "map_bump" ? &named.bump_image : nullptr;
}

constexpr const char *kColourLine = "Kd of materials";

double unit(double value) { return std::clamp(value, 0.0, 1.0); }

// One statement of the current material; false if it makes no sense.
bool read_statement(std::string_view word, std::string_view words, NamedMaterial &named,
                    std::vector<AttributeReport> &report) {
    const auto once = [&](const char *name, Fate fate, const char *note) { report_once(report, {name, fate, note}); };
    const std::string keyword = lower_case(word);
    Material &material = named.material;
    std::array<double, 3> three{};
    double one = 0;
    if (keyword == "kd") {
        if (!read_numbers(words, three))
            return false;
        named.colour = glm::dvec3(three[0], three[1], three[2]);
        once(kColourLine, Fate::kept, "their colours, sRGB, 8 bits");
    } else if (keyword == "ks") {
        if (!read_numbers(words, three))
            return false;
        material.ks = static_cast<float>((unit(three[0]) + unit(three[1]) + unit(three[2])) / 3);
        once("Ks of materials", Fate::converted, "one value: the mean of its channels");
    } else if (keyword == "ns") {
        if (!read_numbers(words, {&one, 1}))
            return false;
        material.power = static_cast<float>(std::clamp(one, 1.0, 1024.0));
        once("Ns of materials", Fate::kept, "specular power, 1 to 1,024");
    } else if (keyword == "pr" || keyword == "pm") {
        if (!read_numbers(words, {&one, 1}))
            return false;
        (keyword == "pr" ? named.roughness : named.metal) = unit(one);
        once(keyword == "pr" ? "Pr of materials" : "Pm of materials", Fate::converted,
             "to coefficients of reflection, in place of Ks and Ns");
    } else if (keyword == "ke") {
        if (!read_numbers(words, three))
            return false;
        for (std::size_t i = 0; i < 3; ++i)
            named.emission[i] = static_cast<std::uint8_t>(unit(three[i]) * 255 + 0.5);
        if (named.emission != Rgb8{})
            once("Ke of materials", Fate::converted,
                 "light that is added to the colours of points, which keep that share of them without light");
    } else if (keyword == "d" || keyword == "tr") {
        if (!read_numbers(words, {&one, 1}))
            return false;
        named.opacity = static_cast<float>(unit(keyword == "d" ? one : 1 - one));
        if (one != (keyword == "d" ? 1 : 0))
            once("opacity of materials", Fate::dropped, "points are opaque");
    } else if (MaterialImage *const image = image_of(keyword, named)) {
        std::vector<std::string> dropped;
        const bool is_relief = image == &named.normal_image || image == &named.bump_image;
        *image = read_image_statement(words, is_relief, dropped);
        for (const std::string &option : dropped)
            drop_once(report, "option " + option + " of images", "not used by PBM");
    } else if (keyword.starts_with("map_")) {
        drop_once(report, std::string(word.substr(0, 16)) + " of materials", "materials of points have no such part");
    } else {
        // Of the format and of its extensions for physically based materials.
        constexpr std::array<std::string_view, 13> kKnown{"Ka", "Tf",  "Ni",    "illum",  "sharpness", "refl", "Ps",
                                                          "Pc", "Pcr", "aniso", "anisor", "disp",      "decal"};
        const auto *const known = std::find_if(kKnown.begin(), kKnown.end(),
                                               [&](std::string_view name) { return lower_case(name) == keyword; });
        drop_once(report,
                  known != kKnown.end() ? std::string(*known) + " of materials" : "further statements of materials",
                  known != kKnown.end() ? "materials of points have no such part" : "not understood");
    }
    return true;
}

} // namespace

void finish_colours(std::span<NamedMaterial> materials, std::vector<AttributeReport> &report) {
    std::vector<glm::vec3> colours;
    for (const NamedMaterial &named : materials)
        if (named.colour)
            colours.emplace_back(*named.colour);
    if (colours.empty())
        return;
    const ColourRange range = colour_range(colours, ColourNumbers::any);
    const double white = range.white > 0 ? static_cast<double>(range.white) : 1;
    for (NamedMaterial &named : materials)
        for (int i = 0; i < 3 && named.colour; ++i)
            named.material.colour[static_cast<std::size_t>(i)] =
                static_cast<std::uint8_t>(unit((*named.colour)[i] / white) * 255 + 0.5);
    const auto line = std::find_if(report.begin(), report.end(), [](const auto &l) { return l.name == kColourLine; });
    if (line == report.end())
        return;
    if (white > 1) {
        line->fate = Fate::converted;
        line->note = "their colours, in 0.." + number_text(white) + ", to sRGB of 8 bits";
    }
    line->note += range.note();
}

void finish_reflectance(NamedMaterial &named) {
    const bool is_physical =
        named.roughness || named.metal || !named.roughness_image.file.empty() || !named.metal_image.file.empty();
    if (!is_physical && !named.emits())
        return;
    named.reflectance = reflectance_of(named.material);
    if (!is_physical)
        return;
    named.reflectance = {named.roughness.value_or(named.reflectance->roughness), named.metal.value_or(0)};
    set_reflectance(*named.reflectance, named.material);
}

void read_materials(std::string_view text, const Material &default_material, std::vector<NamedMaterial> &materials,
                    std::vector<AttributeReport> &report) {
    const std::size_t first = materials.size();
    while (!text.empty()) {
        const std::size_t end = std::min(text.find_first_of("\r\n"), text.size());
        const std::string_view line = trimmed(text.substr(0, end), " \t");
        text.remove_prefix(std::min(end + 1, text.size()));
        const std::size_t space = std::min(line.find_first_of(" \t"), line.size());
        const std::string_view keyword = line.substr(0, space), rest = trimmed(line.substr(space), " \t");
        if (same_word(keyword, "newmtl"))
            materials.push_back({.name = std::string(rest), .material = default_material});
        else if (!keyword.empty() && !keyword.starts_with('#') && materials.size() > first &&
                 !read_statement(keyword, rest, materials.back(), report))
            drop_once(report, std::string(keyword) + " of materials without numbers", "not understood");
    }
}

} // namespace pbm::build
