// A picture cut into lines along the rain: each pixel is in exactly one.
#pragma once

#include <cstddef>
#include <vector>

namespace virga::matte {

/// Lines that go a row at a time and step aside where the slant says so; for slants beyond 45 degrees a column at a
/// time. Never more than half a pixel from the straight line.
class SlantedLines {
public:
    /// slant  [rad] from vertical, -pi/2..pi/2; positive = the lower end lies to the right
    SlantedLines(int width, int height, double slant);

    int count() const { return count_; }    // lines; each starts or ends outside where the slant asks for it
    int length() const { return length_; }  // entries a line: rows, or columns beyond 45 degrees

    /// Index of entry i of a line in a picture of one channel; -1 where the line is outside, or there is no such line.
    std::ptrdiff_t pixel(int line, int i) const
    {
        if (line >= count_) return -1;
        const int across = line + first_ + shift_[std::size_t(i)];
        if (across < 0 || across >= across_) return -1;
        return acrossRows_ ? std::ptrdiff_t(across) * width_ + i : std::ptrdiff_t(i) * width_ + across;
    }

    /// (1 / distance of neighbours on the line)^2 [1/px^2].
    double stepScale() const { return stepScale_; }

private:
    int width_, across_, length_, count_, first_;
    bool acrossRows_;
    double stepScale_;
    std::vector<int> shift_;
};

}  // namespace virga::matte
