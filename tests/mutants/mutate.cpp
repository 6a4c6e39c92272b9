#include "mutants/mutate.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

namespace pbm::mutants {
namespace {

constexpr std::array<const char *, 26> kNumbers{"0",
                                                "-1",
                                                "1",
                                                "2",
                                                "3",
                                                "255",
                                                "256",
                                                "65536",
                                                "2147483647",
                                                "-2147483648",
                                                "4294967295",
                                                "4294967296",
                                                "18446744073709551615",
                                                "99999999999999999999999",
                                                "1e300",
                                                "-1e300",
                                                "1e-300",
                                                "1e999",
                                                "nan",
                                                "-inf",
                                                "1.5",
                                                "0.1e1",
                                                "0x10",
                                                "1,5",
                                                "",
                                                "+3"};

constexpr std::array<const char *, 14> kGarbage{"\n",           " ",         "\t",      "#",     "\\\n",
                                                "//",           "v 0 0 0\n", "f 1 2",   "3 0 1", "solid x",
                                                "\xef\xbb\xbf", "\x1b[31m",  "element", "e"};

class Mutator {
  public:
    Mutator(std::span<const HonestFile> files, Mutant &mutant, Random &random)
        : files_(files), bytes_(mutant.bytes), mutant_(mutant), random_(random) {}

    void mutate();

  private:
    std::size_t place() { return random_.below(bytes_.size() + 1); }
    // A random range (begin, end), begin <= end, often short.
    std::pair<std::size_t, std::size_t> range();
    std::pair<std::size_t, std::size_t> line();
    void exchange(std::pair<std::size_t, std::size_t> a, std::pair<std::size_t, std::size_t> b);
    void change_number();
    void change_binary_number();
    void change_count();
    void change_line_ends();
    void splice();
    void say(const std::string &what, std::size_t at) { mutant_.story += what + " at " + std::to_string(at) + "; "; }

    std::span<const HonestFile> files_;
    std::string &bytes_;
    Mutant &mutant_;
    Random &random_;
};

std::pair<std::size_t, std::size_t> Mutator::range() {
    const std::size_t begin = place();
    const std::size_t most = random_.below(4) == 0 ? bytes_.size() : 64;
    return {begin, std::min(bytes_.size(), begin + random_.below(most + 1))};
}

std::pair<std::size_t, std::size_t> Mutator::line() {
    const std::size_t at = random_.below(bytes_.size());
    const std::size_t before = at == 0 ? std::string::npos : bytes_.rfind('\n', at - 1);
    const std::size_t end = bytes_.find('\n', at);
    return {before == std::string::npos ? 0 : before + 1, end == std::string::npos ? bytes_.size() : end + 1};
}

void Mutator::exchange(std::pair<std::size_t, std::size_t> a, std::pair<std::size_t, std::size_t> b) {
    if (b < a)
        std::swap(a, b);
    if (a.second > b.first)
        return;
    say("exchanged", a.first);
    bytes_ = bytes_.substr(0, a.first) + bytes_.substr(b.first, b.second - b.first) +
             bytes_.substr(a.second, b.first - a.second) + bytes_.substr(a.first, a.second - a.first) +
             bytes_.substr(b.second);
}

// Changes a random number of the text.
void Mutator::change_number() {
    const std::size_t at = bytes_.find_first_of("0123456789", random_.below(bytes_.size()));
    if (at == std::string::npos)
        return;
    const std::size_t begin = bytes_.find_last_not_of("0123456789.-+e", at);
    const std::size_t first = begin == std::string::npos ? 0 : begin + 1;
    const std::size_t end = std::min(bytes_.find_first_not_of("0123456789.-+e", at), bytes_.size());
    say("number changed", first);
    bytes_.replace(first, end - first, kNumbers[random_.below(kNumbers.size())]);
}

void Mutator::change_binary_number() {
    constexpr std::array<std::uint64_t, 8> kValues{
        0,          ~std::uint64_t{0}, 0x7fc000007fc00000U, 0x7f8000007f800000U,
        0x80000000, 0x7fffffff,        0x0000000100000001U, 0x7fefffffffffffffU};
    const std::size_t size = std::size_t{1} << random_.below(4), at = place();
    if (size > bytes_.size() - at)
        return;
    say("binary number changed", at);
    const std::uint64_t value = kValues[random_.below(kValues.size())];
    for (std::size_t i = 0; i < size; ++i)
        bytes_[at + i] = static_cast<char>(value >> (8 * i));
}

// Changes a count, which stands at another place in each format.
void Mutator::change_count() {
    const Format format = mutant_.origin->format;
    if (format == Format::stl_binary) {
        if (bytes_.size() < 84)
            return;
        say("count changed", 80);
        bytes_[80 + random_.below(4)] = static_cast<char>(random_.below(256));
        return;
    }
    std::size_t at = 0;
    if (format == Format::ply_ascii || format == Format::ply_binary)
        at = bytes_.find("element ", random_.below(std::min<std::size_t>(bytes_.size(), 300)));
    else if (format == Format::obj)
        at = bytes_.find("# ");
    else if (format == Format::pcd_ascii || format == Format::pcd_binary)
        at = bytes_.find("POINTS ");
    else if (format == Format::gltf)
        at = bytes_.find("\"count\":", random_.below(bytes_.size()));
    at = at == std::string::npos ? at : bytes_.find_first_of("0123456789", at);
    if (at == std::string::npos)
        return;
    const std::size_t end = std::min(bytes_.find_first_not_of("0123456789", at), bytes_.size());
    say("count changed", at);
    const std::array<std::string, 6> kCounts{"0",          "1",          std::to_string(20 + random_.below(20)),
                                             "1000000000", "4294967296", "18446744073709551615"};
    bytes_.replace(at, end - at, kCounts[random_.below(kCounts.size())]);
}

void Mutator::change_line_ends() {
    const std::size_t kind = random_.below(4);
    say("line ends changed", kind);
    std::string out;
    for (const char c : bytes_)
        if (c != '\n')
            out += c;
        else if (kind == 0)
            out += "\r\n";
        else if (kind == 1)
            out += '\r';
        else if (kind == 2)
            out += random_.below(8) == 0 ? "" : "\n";
        else
            out += random_.below(2) == 0 ? "\n" : "\r\n";
    bytes_ = out;
}

void Mutator::splice() {
    const HonestFile &other = files_[random_.below(files_.size())];
    const std::size_t at = place(), from = random_.below(other.bytes.size());
    say("goes on as another file", at);
    bytes_ = bytes_.substr(0, at) + other.bytes.substr(from);
}

void Mutator::mutate() {
    if (bytes_.empty())
        return;
    switch (random_.below(16)) {
    case 0: {
        const std::size_t at = random_.below(bytes_.size());
        say("cut", at);
        bytes_.resize(at);
        return;
    }
    case 1:
    case 2: {
        const auto [begin, end] = random_.below(2) == 0 ? range() : line();
        say("removed " + std::to_string(end - begin), begin);
        bytes_.erase(begin, end - begin);
        return;
    }
    case 3:
    case 4: {
        const auto [begin, end] = random_.below(2) == 0 ? range() : line();
        say("doubled " + std::to_string(end - begin), begin);
        bytes_.insert(end, bytes_.substr(begin, end - begin));
        return;
    }
    case 5: return exchange(range(), range());
    case 6: return exchange(line(), line());
    case 7:
    case 8:
        for (std::size_t i = 0, flips = 1 + random_.below(4); i < flips; ++i) {
            const std::size_t at = random_.below(bytes_.size());
            say("bit flipped", at);
            bytes_[at] = static_cast<char>(bytes_[at] ^ (1 << random_.below(8)));
        }
        return;
    case 9:
    case 10: return change_number();
    case 11: return change_binary_number();
    case 12: {
        const std::size_t at = place();
        say("garbage", at);
        std::string garbage = kGarbage[random_.below(kGarbage.size())];
        for (std::size_t i = 0, more = random_.below(3) == 0 ? random_.below(40) : 0; i < more; ++i)
            garbage += static_cast<char>(random_.below(256));
        bytes_.insert(at, garbage);
        return;
    }
    case 13: return change_line_ends();
    case 14: return splice();
    default: return change_count();
    }
}

} // namespace

Mutant mutate(std::span<const HonestFile> files, std::size_t origin, Random random) {
    const HonestFile &file = files[origin];
    Mutant mutant{.origin = &file, .bytes = file.bytes, .story = {}, .cut_at = {}};
    if (random.below(8) == 0) {
        mutant.cut_at = random.below(file.bytes.size());
        mutant.bytes.resize(*mutant.cut_at);
        mutant.story = "cut at " + std::to_string(*mutant.cut_at);
        return mutant;
    }
    const std::size_t count = 1 + random.below(3) * random.below(2);
    for (std::size_t i = 0; i < count; ++i)
        Mutator(files, mutant, random).mutate();
    return mutant;
}

} // namespace pbm::mutants
