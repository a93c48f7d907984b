#include "rover/matching/kernels.h"

#include <gtest/gtest.h>
#include <Eigen/Core>

#include "rover/base/random.h"

namespace rover {
namespace {

using Rows = Eigen::Matrix<float, Eigen::Dynamic, Eigen::Dynamic, Eigen::RowMajor>;

Rows random_matrix(int rows, int columns, std::uint64_t seed) {
  Random random(seed);
  Rows matrix(rows, columns);
  for (float& value : matrix.reshaped()) value = static_cast<float>(random.gaussian());
  return matrix;
}

// Every instruction set that this machine runs, the portable baseline included, against Eigen.
class Kernels : public testing::TestWithParam<const MatchingKernels*> {};

INSTANTIATE_TEST_SUITE_P(All, Kernels, testing::ValuesIn(available_matching_kernels()),
                         [](const auto& set) { return std::string(set.param->name); });

TEST_P(Kernels, Similarities) {
  for (int size : {1, 7, 64, 128, 256}) {
    const Rows rows = random_matrix(20, size, 1), query = random_matrix(1, size, 2);
    const std::vector<int> indices = {3, 0, 19, 3};
    std::vector<float> out(indices.size());
    GetParam()->similarities(query.data(), rows.data(), size, indices.data(), 4, out.data());
    for (int i = 0; i < 4; ++i) EXPECT_NEAR(out[i], rows.row(indices[i]).dot(query.row(0)), 1e-4);
  }
}

TEST_P(Kernels, Product) {
  for (const auto& [m, n] : {std::pair(1, 1), {5, 16}, {13, 17}, {24, 100}}) {
    for (int size : {3, 64}) {
      const Rows a = random_matrix(m, size, 1), b = random_matrix(n, size, 2);
      const auto packed = pack_transposed(b.data(), n, size);
      const int stride = static_cast<int>(packed.size()) / size;
      EXPECT_EQ(stride % MatchingKernels::kPackWidth, 0);
      Rows out(m, stride);
      GetParam()->product(a.data(), m, packed.data(), stride, size, out.data());
      EXPECT_LT((out.leftCols(n) - a * b.transpose()).cwiseAbs().maxCoeff(), 1e-4f);
      EXPECT_TRUE(out.rightCols(stride - n).isZero());
    }
  }
}

TEST_P(Kernels, Maxima) {
  for (int count : {1, 2, 15, 100}) {
    const Rows rows = random_matrix(9, count, count);
    std::vector<float> column_best(count, -10.0f);
    std::vector<int> column_index(count, -1);
    for (int r = 0; r < 9; ++r) {
      float best = 0, second = 0;
      int index = -1;
      GetParam()->row_maximum(rows.row(r).data(), count, &best, &index, &second);
      int expected = -1;
      EXPECT_EQ(best, rows.row(r).maxCoeff(&expected));
      EXPECT_EQ(index, expected);
      Rows others = rows.row(r);
      others(expected) = -3e38f;
      EXPECT_EQ(second, others.maxCoeff());
      GetParam()->column_maxima(rows.row(r).data(), count, r, column_best.data(),
                                column_index.data());
    }
    for (int c = 0; c < count; ++c) {
      int expected = -1;
      EXPECT_EQ(column_best[c], rows.col(c).maxCoeff(&expected));
      EXPECT_EQ(column_index[c], expected);
    }
  }
}

TEST_P(Kernels, Align) {
  Random random(3);
  std::vector<std::uint8_t> image(400);  // 20 px wide, window at (1, 2)
  for (auto& pixel : image) pixel = static_cast<std::uint8_t>(random.index(256));
  for (int window : {5, 11, 15}) {
    AlignmentTemplate reference;
    reference.window = window;
    AlignmentSums expected;
    for (int r = 0; r < window; ++r) {
      for (int c = 0; c < window; ++c) {
        const int at = r * AlignmentTemplate::kStride + c;
        reference.inside[c] = 1;
        reference.intensity[at] = static_cast<float>(random.gaussian());
        reference.gradient_x[at] = static_cast<float>(random.gaussian());
        reference.gradient_y[at] = static_cast<float>(random.gaussian());
        const std::uint8_t* p = &image[(r + 2) * 20 + c + 1];
        const float value =
            0.7f * (0.6f * p[0] + 0.4f * p[1]) + 0.3f * (0.6f * p[20] + 0.4f * p[21]) - 100;
        expected.image += value;
        expected.image_square += value * value;
        expected.image_template += value * reference.intensity[at];
        expected.image_gradient_x += value * reference.gradient_x[at];
        expected.image_gradient_y += value * reference.gradient_y[at];
      }
    }
    const auto sums = GetParam()->align(&image[2 * 20 + 1], 20, 0.4f, 0.3f, 100, reference);
    EXPECT_NEAR(sums.image, expected.image, 1e-1);
    EXPECT_NEAR(sums.image_square, expected.image_square, 1e-5 * expected.image_square);
    EXPECT_NEAR(sums.image_template, expected.image_template, 1e-1);
    EXPECT_NEAR(sums.image_gradient_x, expected.image_gradient_x, 1e-1);
    EXPECT_NEAR(sums.image_gradient_y, expected.image_gradient_y, 1e-1);
  }
}

}  // namespace
}  // namespace rover
