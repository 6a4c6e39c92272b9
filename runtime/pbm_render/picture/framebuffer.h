// The picture being drawn: colours and z-buffer.
// Stability: stable.
#pragma once

#include "pbm_format/model/point_values.h"

#include <glm/vec2.hpp>

#include <array>
#include <cstdint>
#include <memory>
#include <new>
#include <type_traits>
#include <utility>
#include <vector>

namespace pbm {

// SIMD vectors of four numbers, or two.
using Float4 = float __attribute__((vector_size(16)));
using Int4 = std::int32_t __attribute__((vector_size(16)));
using Long2 = std::int64_t __attribute__((vector_size(16)));

// sRGB with straight (not premultiplied) alpha.
using Rgba8 = std::array<std::uint8_t, 4>;

// Red in the lowest byte, so that pixels lie in memory as R G B A.
constexpr std::uint32_t pack_rgba(Rgba8 c) {
    return std::uint32_t{c[0]} | std::uint32_t{c[1]} << 8 | std::uint32_t{c[2]} << 16 | std::uint32_t{c[3]} << 24;
}
constexpr std::uint32_t pack_rgb(Rgb8 c) { return pack_rgba({c[0], c[1], c[2], 0}); }
constexpr Rgba8 unpack_rgba(std::uint32_t c) {
    return {static_cast<std::uint8_t>(c), static_cast<std::uint8_t>(c >> 8), static_cast<std::uint8_t>(c >> 16),
            static_cast<std::uint8_t>(c >> 24)};
}

// Leaves new elements uninitialized, so that the drawing thread is the first to touch a page.
template <class T> struct UninitializedAllocator : std::allocator<T> {
    template <class U> struct rebind { using other = UninitializedAllocator<U>; };
    using std::allocator<T>::allocator;
    template <class U> void construct(U *at) { ::new (static_cast<void *>(at)) U; }
    template <class U, class... Arguments> void construct(U *at, Arguments &&...arguments) {
        ::new (static_cast<void *>(at)) U(std::forward<Arguments>(arguments)...);
    }
    // GCC 12 ends the life of a vector type by a store of zeros: freeing an array would write all of it.
    template <class U> void destroy(U *) { static_assert(std::is_trivially_destructible_v<U>); }
};
template <class T> using PixelArray = std::vector<T, UninitializedAllocator<T>>;

inline constexpr int kMaxPictureEdge = 32768;

// One row of a picture. `depths` holds grid edges times `depth_scale`; null: the caller needs no depths.
struct PixelRow {
    std::uint32_t *colours; // [width]
    float *depths;          // [width]
    std::size_t width;      // pixels
    float depth_scale;
};

// Both arrays are [height][width], top row first; the centre of pixel (x, y) is at (x + 0.5, y + 0.5).
struct Framebuffer {
    // With depths, everything is cleared and padding follows, so that any 2 x 2 block that starts inside can be read
    // and written. Without depths, `depth` is empty and pixels are uninitialized.
    Framebuffer(int width, int height, bool with_depths = true);
    // Not inline: only an optimising compiler frees PixelArrays without a loop over their elements, 0.7 ms a picture.
    ~Framebuffer();
    Framebuffer(const Framebuffer &);
    Framebuffer(Framebuffer &&) noexcept;
    Framebuffer &operator=(const Framebuffer &);
    Framebuffer &operator=(Framebuffer &&) noexcept;

    // Fills colour with `background` and depth with +infinity.
    void clear(Rgba8 background);

    glm::vec2 centre(std::size_t at) const {
        const auto columns = static_cast<std::size_t>(width);
        const std::size_t x = at % columns, y = at / columns;
        return {static_cast<float>(x) + 0.5F, static_cast<float>(y) + 0.5F};
    }
    std::size_t pixels() const { return static_cast<std::size_t>(width) * static_cast<std::size_t>(height); }

    int width, height;                // pixels, each 1..kMaxPictureEdge
    Float4 limits;                    // width, width, height, height
    PixelArray<std::uint32_t> colour; // pack_rgba
    PixelArray<float> depth;          // as colour; distance along the view direction, model units; +infinity: empty
};

} // namespace pbm
