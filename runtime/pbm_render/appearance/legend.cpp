#include "pbm_render/appearance/legend.h"

#include "pbm_format/model/las_classes.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wconversion"
#pragma GCC diagnostic ignored "-Wsign-conversion"
#pragma GCC diagnostic ignored "-Wunused-function"
#include <stb/stb_easy_font.h>
#pragma GCC diagnostic pop

namespace pbm {
namespace {

// Sizes in units of the font, whose capitals are 7 units high.
constexpr int kPadding = 6, kLine = 12, kSwatch = 10, kGap = 5, kBarHeight = 120, kMaxRows = 20;

std::string number(double value, int digits = 6) {
    std::array<char, 32> text{};
    char *const end = text.data() + text.size();
    return {text.data(), std::to_chars(text.data(), end, value, std::chars_format::general, digits).ptr};
}

// The values at the ends and in the middle of a range, to a hundredth of it: coordinates that are measured from far
// away have no more digits than others.
std::array<std::string, 3> tick_texts(double least, double most) {
    if (least == most)
        return {"", number(least), ""};
    constexpr int kPlain = 9; // digits before the point that are written without a power of ten
    const auto power_of = [](double size) { return static_cast<int>(std::floor(std::log10(size))); };
    const int power = power_of(std::max(std::fabs(least), std::fabs(most))), step = power_of(most - least) - 2;
    const int digits = std::clamp(std::max(power - step + 1, std::min(power + 1, kPlain)), 1, 17);
    const double unit = std::pow(10, step);
    const std::array<double, 3> values{least, (least + most) / 2, most};
    std::array<std::string, 3> texts;
    for (std::size_t i = 0; i < texts.size(); ++i)
        texts[i] = number(std::round(values[i] / unit) * unit + 0.0, digits); // 0 for -0
    return texts;
}

std::string label_text(const Field &field, std::uint32_t stored) {
    const double value = field.value(stored), label = std::round(value);
    const bool is_class = field.name == "classification" && label >= 0 && label <= 65535;
    const std::string_view name = is_class ? class_name(static_cast<std::uint32_t>(label)) : std::string_view();
    std::string text = number(value);
    if (!name.empty())
        (text += ' ') += name;
    return text;
}

// What the font can draw.
std::string ascii(std::string_view text) {
    std::string result;
    for (const char c : text)
        if ((static_cast<unsigned char>(c) & 0xC0) != 0x80) // one sign for each letter
            result += c >= ' ' && c <= '~' ? c : '?';
    return result;
}

int width_of(std::string text) { return stb_easy_font_width(text.data()); }

// A corner of the picture in which units of the font are squares of pixels.
class Canvas {
  public:
    Canvas(Framebuffer &target, int left, int top, int scale)
        : target_(target), left_(left), top_(top), scale_(scale) {}

    // Blends a rectangle of units; `opacity` of 256.
    void fill(int x, int y, int width, int height, Rgb8 colour, unsigned opacity = 256) {
        const int first = std::max(0, top_ + y * scale_), end = std::min(target_.height, top_ + (y + height) * scale_);
        const int from = std::max(0, left_ + x * scale_), to = std::min(target_.width, left_ + (x + width) * scale_);
        for (int row = first; row < end; ++row)
            for (int column = from; column < to; ++column) {
                std::uint32_t &pixel =
                    target_.colour[static_cast<std::size_t>(row) * static_cast<std::size_t>(target_.width) +
                                   static_cast<std::size_t>(column)];
                Rgba8 below = unpack_rgba(pixel);
                for (std::size_t c = 0; c < 3; ++c)
                    below[c] = static_cast<std::uint8_t>((colour[c] * opacity + below[c] * (256 - opacity)) / 256);
                below[3] = static_cast<std::uint8_t>(std::max<unsigned>(below[3], opacity * 255 / 256));
                pixel = pack_rgba(below);
            }
    }

    void write(int x, int y, std::string text, Rgb8 colour = {240, 240, 240}) {
        struct Vertex {
            float x, y, z;
            std::array<unsigned char, 4> colour;
        };
        std::vector<std::array<Vertex, 4>> strokes(40 * (text.size() + 1));
        const int count = stb_easy_font_print(0, 0, text.data(), nullptr, strokes.data(),
                                              static_cast<int>(strokes.size() * sizeof strokes[0]));
        for (int i = 0; i < count; ++i) {
            const auto &[first, second, last, fourth] = strokes[static_cast<std::size_t>(i)];
            fill(x + static_cast<int>(first.x), y + static_cast<int>(first.y), static_cast<int>(last.x - first.x),
                 static_cast<int>(last.y - first.y), colour);
        }
    }

  private:
    Framebuffer &target_;
    int left_, top_, scale_;
};

} // namespace

std::optional<Legend> legend_of(const FieldColours &colours, const HiddenClasses *hidden) {
    if (colours.basis == ColourBasis::plain)
        return std::nullopt;
    if (colours.basis == ColourBasis::normal)
        return Legend{.title = "normal",
                      .rows = {{{255, 128, 128}, "x"}, {{128, 255, 128}, "y"}, {{128, 128, 255}, "z"}}};
    const Field &field = colours.description;
    Legend legend{.title = ascii(field.name + (field.unit.empty() ? "" : " (" + field.unit + ")")), .rows = {}};
    if (colours.map == ColourMap::classes) {
        for (const std::uint32_t stored : colours.labels) {
            if (hidden != nullptr && hidden->field == colours.field && hidden->hides[stored] != 0)
                continue;
            if (legend.rows.size() == kMaxRows) {
                legend.rows.back() = {{96, 96, 96}, "more"};
                break;
            }
            legend.rows.push_back({colours.palette[colours.indices[stored]], label_text(field, stored)});
        }
        return legend;
    }
    for (std::size_t i = 0; i < legend.bar.size(); ++i) // its values are evenly spaced, whatever the gamma
        legend.bar[i] = colours.palette[static_cast<std::size_t>(
            1 + std::lround(254 * std::pow(static_cast<double>(i) / 254, colours.gamma)))];
    legend.ticks = tick_texts(colours.least, colours.most);
    return legend;
}

void draw_legend(const Legend &legend, Framebuffer &target) {
    const int scale = std::max(1, static_cast<int>(std::lround(target.height / 480.0)));
    const bool is_bar = legend.rows.empty();
    int text_width = width_of(legend.title) - kSwatch - kGap;
    for (const std::string &tick : legend.ticks)
        text_width = std::max(text_width, width_of(tick));
    for (const Legend::Row &row : legend.rows)
        text_width = std::max(text_width, width_of(row.text));
    const int body = is_bar ? kBarHeight : kLine * static_cast<int>(legend.rows.size());
    const int width = 2 * kPadding + kSwatch + kGap + text_width, height = 2 * kPadding + kLine + kGap + body;
    if (3 * width * scale > target.width || height * scale > target.height)
        return;
    Canvas canvas(target, target.width - (width + kPadding) * scale, kPadding * scale, scale);
    canvas.fill(0, 0, width, height, {16, 16, 16}, 176);
    canvas.write(kPadding, kPadding, legend.title);
    const int top = kPadding + kLine + kGap, text = kPadding + kSwatch + kGap;
    for (std::size_t i = 0; i < legend.rows.size(); ++i) {
        const int y = top + kLine * static_cast<int>(i);
        canvas.fill(kPadding, y - 1, kSwatch, kSwatch, legend.rows[i].colour);
        canvas.write(text, y, legend.rows[i].text);
    }
    if (!is_bar)
        return;
    for (int y = 0; y < kBarHeight; ++y)
        canvas.fill(kPadding, top + y, kSwatch, 1,
                    legend.bar[static_cast<std::size_t>((kBarHeight - 1 - y) * 254 / (kBarHeight - 1))]);
    for (int tick = 0; tick < 3; ++tick)
        canvas.write(text, top + (2 - tick) * (kBarHeight - 7) / 2, legend.ticks[static_cast<std::size_t>(tick)]);
}

void draw_bar(int pixels, const std::string &text, int letter, Framebuffer &target) {
    constexpr int kLetter = 7, kThick = 2, kMargin = 14; // units of the font
    const int scale = letter > 0 ? std::max(1, static_cast<int>(std::lround(letter / static_cast<double>(kLetter))))
                                 : std::max(1, static_cast<int>(std::lround(target.height / 480.0)));
    const int left = kMargin * scale, top = target.height - (kMargin + kLetter + kGap + kThick) * scale;
    if (top < 0 || left + pixels > target.width)
        return;
    int bright = 0, seen = 0;
    for (int y = top; y < target.height; ++y)
        for (int x = left; x < left + pixels; ++x, ++seen) {
            const Rgba8 below =
                unpack_rgba(target.colour[static_cast<std::size_t>(y) * static_cast<std::size_t>(target.width) +
                                          static_cast<std::size_t>(x)]);
            bright += below[1] >= 128 || below[3] < 128 ? 1 : 0;
        }
    const Rgb8 ink = 2 * bright >= seen ? Rgb8{0, 0, 0} : Rgb8{255, 255, 255};
    Canvas(target, left, top, scale).write(0, 0, ascii(text), ink);
    const int bar = top + (kLetter + kGap) * scale, thick = kThick * scale;
    Canvas line(target, left, bar, 1);
    line.fill(0, 0, pixels, thick, ink);
    for (const int end : {0, pixels - scale})
        line.fill(end, -thick, scale, 3 * thick, ink);
}

} // namespace pbm
