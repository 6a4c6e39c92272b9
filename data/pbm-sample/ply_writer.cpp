#include "ply_writer.h"

#include <bit>
#include <cerrno>
#include <charconv>
#include <cstring>
#include <utility>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace pbm::sample {

namespace {

// Collects bytes and writes them in large pieces; keeps the first error.
class Output {
  public:
    explicit Output(int descriptor) : descriptor_(descriptor) { buffer_.reserve(kFlushAt + 256); }

    void text(const std::string &s) { buffer_ += s; }
    void byte(std::uint8_t b) { buffer_ += static_cast<char>(b); }
    void word(std::uint32_t w) {
        for (int shift = 0; shift < 32; shift += 8)
            buffer_ += static_cast<char>(w >> shift & 0xffu);
    }
    // Shortest decimal that reads back the same, then `after`.
    template <typename Number> void number(Number value, char after) {
        char digits[32];
        const auto end = std::to_chars(digits, digits + sizeof digits, value).ptr;
        buffer_.append(digits, end);
        buffer_ += after;
    }
    void flush_if_large() {
        if (buffer_.size() >= kFlushAt)
            flush();
    }
    void flush() {
        const char *at = buffer_.data();
        std::size_t left = buffer_.size();
        while (left > 0 && !error_) {
            const ssize_t written = ::write(descriptor_, at, left);
            if (written >= 0) {
                at += written;
                left -= static_cast<std::size_t>(written);
            } else if (errno != EINTR) {
                error_ = {errno, std::generic_category()};
            }
        }
        buffer_.clear();
    }
    std::error_code error() const { return error_; }

  private:
    static constexpr std::size_t kFlushAt = 1u << 20;
    int descriptor_;
    std::string buffer_;
    std::error_code error_;
};

std::string header(const TriangleMesh &mesh, PlyEncoding encoding, const std::string &comment) {
    return "ply\nformat " + std::string(encoding == PlyEncoding::ascii ? "ascii" : "binary_little_endian") +
           " 1.0\ncomment " + comment + "\nelement vertex " + std::to_string(mesh.position.size()) +
           "\nproperty float x\nproperty float y\nproperty float z\n"
           "property uchar red\nproperty uchar green\nproperty uchar blue\nelement face " +
           std::to_string(mesh.triangle.size()) + "\nproperty list uchar int vertex_indices\nend_header\n";
}

void write_binary(const TriangleMesh &mesh, Output &out) {
    for (std::size_t i = 0; i < mesh.position.size() && !out.error(); ++i) {
        for (const float x : mesh.position[i])
            out.word(std::bit_cast<std::uint32_t>(x));
        for (const std::uint8_t c : mesh.color[i])
            out.byte(c);
        out.flush_if_large();
    }
    for (std::size_t i = 0; i < mesh.triangle.size() && !out.error(); ++i) {
        out.byte(3);
        for (const std::uint32_t v : mesh.triangle[i])
            out.word(v);
        out.flush_if_large();
    }
}

void write_ascii(const TriangleMesh &mesh, Output &out) {
    for (std::size_t i = 0; i < mesh.position.size() && !out.error(); ++i) {
        for (const float x : mesh.position[i])
            out.number(x, ' ');
        const auto &c = mesh.color[i];
        out.number(unsigned{c[0]}, ' ');
        out.number(unsigned{c[1]}, ' ');
        out.number(unsigned{c[2]}, '\n');
        out.flush_if_large();
    }
    for (std::size_t i = 0; i < mesh.triangle.size() && !out.error(); ++i) {
        const auto &t = mesh.triangle[i];
        out.text("3 ");
        out.number(t[0], ' ');
        out.number(t[1], ' ');
        out.number(t[2], '\n');
        out.flush_if_large();
    }
}

std::error_code write_to(const TriangleMesh &mesh, int descriptor, PlyEncoding encoding, const std::string &comment) {
    Output out(descriptor);
    out.text(header(mesh, encoding, comment));
    if (encoding == PlyEncoding::ascii)
        write_ascii(mesh, out);
    else
        write_binary(mesh, out);
    out.flush();
    return out.error();
}

std::error_code last_error() { return {errno, std::generic_category()}; }

} // namespace

std::error_code write_ply(const TriangleMesh &mesh, const std::string &path, PlyEncoding encoding,
                          const std::string &comment) {
    if (path == "-")
        return write_to(mesh, STDOUT_FILENO, encoding, comment);
    struct stat existing {};
    if (::stat(path.c_str(), &existing) == 0 && !S_ISREG(existing.st_mode)) { // a device or pipe is written to as it is
        const int descriptor = ::open(path.c_str(), O_WRONLY | O_CLOEXEC);
        if (descriptor < 0)
            return last_error();
        const std::error_code error = write_to(mesh, descriptor, encoding, comment);
        return ::close(descriptor) != 0 && !error ? last_error() : error;
    }
    const std::string sibling = path + ".part" + std::to_string(::getpid());
    const int descriptor = ::open(sibling.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666);
    if (descriptor < 0)
        return last_error();
    std::error_code error = write_to(mesh, descriptor, encoding, comment);
    if (!error && ::fsync(descriptor) != 0)
        error = last_error();
    if (::close(descriptor) != 0 && !error)
        error = last_error();
    if (!error && ::rename(sibling.c_str(), path.c_str()) != 0)
        error = last_error();
    if (error)
        ::unlink(sibling.c_str());
    return error;
}

} // namespace pbm::sample
