// The alpha step without bounds, as the paper has it.
#pragma once

#include <vector>

#include "matte/AlphaProblem.h"
#include "matte/BoundedLines.h"

namespace virga::matte {

class FreeAlpha {
public:
    FreeAlpha(const FrameData& data, int width, int height, const RainTerms& terms);

    /// Conjugate gradients, with the columns alone as preconditioner. alpha: where they start, and the answer.
    /// tolerance: of the residual, relative to the right side's norm.
    void solve(ImageF& alpha, double tolerance);

private:
    using Block = LineBlock<double>;

    void multiply(const std::vector<double>& v, std::vector<double>& to) const;
    void columns(const std::vector<double>& from, std::vector<double>& to) const;

    AlongRain matrix_;
    double mu_;
    std::vector<double> seen_, right_;
};

}  // namespace virga::matte
