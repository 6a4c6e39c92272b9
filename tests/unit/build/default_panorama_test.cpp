#include "pbm_build/panorama/default_panorama.h"

#include <gtest/gtest.h>
#include <hwy/targets.h>

#include <cmath>
#include <cstdlib>

namespace pbm::build {
namespace {

int channel_at(const Image &image, std::size_t x, std::size_t y, std::size_t channel) {
    return image.texels[(y * image.width + x) * 3 + channel];
}

// Mean difference of neighbouring columns x and x + 1, wrapped.
double step(const Image &image, std::size_t x) {
    double sum = 0;
    for (std::size_t y = 0; y < image.height; ++y)
        for (std::size_t channel = 0; channel < 3; ++channel)
            sum += std::abs(channel_at(image, x, y, channel) - channel_at(image, (x + 1) % image.width, y, channel));
    return sum / (3.0 * image.height);
}

double mean_of_row(const Image &image, std::size_t y) {
    double sum = 0;
    for (std::size_t x = 0; x < image.width; ++x)
        for (std::size_t channel = 0; channel < 3; ++channel)
            sum += channel_at(image, x, y, channel);
    return sum / (3.0 * image.width);
}

TEST(DefaultPanorama, HasTheShapeAsked) {
    for (const std::uint32_t width : {16U, 64U, 512U}) {
        const Image image = default_panorama(width, 1);
        EXPECT_EQ(image.width, width);
        EXPECT_EQ(image.height, width / 2);
        EXPECT_EQ(image.channels, 3U);
        EXPECT_EQ(image.texels.size(), std::size_t{width} * width / 2 * 3);
    }
}

TEST(DefaultPanorama, HasNoSeam) {
    const Image image = default_panorama(512, 2);
    double all = 0, largest = 0;
    for (std::size_t x = 0; x + 1 < image.width; ++x) {
        all += step(image, x) / (image.width - 1);
        largest = std::max(largest, step(image, x));
    }
    EXPECT_LT(step(image, image.width - 1), largest);
    EXPECT_LT(step(image, image.width - 1), 2 * all);
}

// Near a pole all columns show nearly the same direction.
TEST(DefaultPanorama, HasNoPinchAtThePoles) {
    const Image image = default_panorama(512, 2);
    for (const std::size_t y : {std::size_t{0}, std::size_t{image.height - 1}})
        for (std::size_t channel = 0; channel < 3; ++channel) {
            int low = 255, high = 0;
            for (std::size_t x = 0; x < image.width; ++x) {
                low = std::min(low, channel_at(image, x, y, channel));
                high = std::max(high, channel_at(image, x, y, channel));
            }
            EXPECT_LE(high - low, 16) << y;
        }
}

TEST(DefaultPanorama, SkyIsUpAndTheSunBehindTheCameraToTheLeft) {
    const Image image = default_panorama(512, 2);
    EXPECT_GT(mean_of_row(image, 100), mean_of_row(image, 180) + 20);
    EXPECT_GT(channel_at(image, 256, 40, 2), channel_at(image, 256, 40, 0)); // more blue than red
    double brightest = 0, x_sum = 0, y_sum = 0, count = 0;
    for (std::size_t y = 0; y < image.height; ++y)
        for (std::size_t x = 0; x < image.width; ++x)
            if (const double light =
                    channel_at(image, x, y, 0) + channel_at(image, x, y, 1) + channel_at(image, x, y, 2);
                light >= brightest) {
                if (light > brightest)
                    x_sum = y_sum = count = 0;
                brightest = light;
                x_sum += static_cast<double>(x);
                y_sum += static_cast<double>(y);
                ++count;
            }
    EXPECT_GE(brightest, 3 * 250);
    EXPECT_LT(x_sum / count, 128); // the left quarter is behind and left of a camera that looks at the middle
    EXPECT_LT(y_sum / count, 128);
}

// FNV-1a: the same for every compiler and machine.
TEST(DefaultPanorama, HasItsGoldenTexels) {
    std::uint64_t hash = 0xCBF29CE484222325;
    for (const std::uint8_t byte : default_panorama(256, 1).texels)
        hash = (hash ^ byte) * 0x100000001B3;
    EXPECT_EQ(hash, 13278705809972521217U);
}

TEST(DefaultPanorama, SameTexelsFromEveryProcessorAndThreadCount) {
    const Bytes expected = default_panorama(256, 1).texels;
    EXPECT_EQ(default_panorama(256, 7).texels, expected);
    for (std::int64_t targets = hwy::SupportedTargets(); targets != 0; targets &= targets - 1) {
        hwy::SetSupportedTargetsForTest(targets & -targets);
        EXPECT_EQ(default_panorama(256, 1).texels, expected) << hwy::TargetName(targets & -targets);
    }
    hwy::SetSupportedTargetsForTest(0);
}

} // namespace
} // namespace pbm::build
