#include "rover/simulation/sensor.h"

#include <algorithm>

#include <gtest/gtest.h>

#include "rover/base/error.h"

namespace rover {
namespace {

SensorOptions linear_sensor() {
  SensorOptions options;
  options.gamma = 1;
  options.vignetting = 0;
  options.black_level = 0;
  return options;
}

cv::Scalar deviation_of(const cv::Mat& image, double* mean) {
  cv::Scalar average, deviation;
  cv::meanStdDev(image, average, deviation);
  *mean = average[0];
  return deviation;
}

TEST(Sensor, NoiseIsThatOfPhotonsAndReading) {
  SensorOptions options = linear_sensor();
  options.full_scale_electrons = 2000;
  options.read_noise = 20;
  const cv::Size size(400, 300);
  const Sensor sensor(options, size);
  for (const double signal : {0.2, 0.5, 0.8}) {
    const cv::Mat image = sensor.expose(cv::Mat(size, CV_32F, cv::Scalar(signal)), 1, 3);
    double mean = 0;
    const double deviation = deviation_of(image, &mean)[0];
    const double electrons = signal * 2000;
    const double expected = 255.0 / 2000 * std::sqrt(electrons + 20 * 20);
    EXPECT_NEAR(mean, 255 * signal, 0.2);
    EXPECT_NEAR(deviation, std::sqrt(expected * expected + 1 / 12.0), 0.03 * expected);
  }
}

TEST(Sensor, NoiseOfTwoSeedsIsUnrelated) {
  const cv::Size size(200, 200);
  const Sensor sensor(linear_sensor(), size);
  const cv::Mat radiance(size, CV_32F, cv::Scalar(0.4));
  cv::Mat a, b;
  sensor.expose(radiance, 1, 1).convertTo(a, CV_32F);
  sensor.expose(radiance, 1, 2).convertTo(b, CV_32F);
  const cv::Mat da = a - cv::mean(a)[0], db = b - cv::mean(b)[0];
  EXPECT_LT(std::abs(da.dot(db)) / std::sqrt(da.dot(da) * db.dot(db)), 0.02);
  EXPECT_EQ(cv::norm(sensor.expose(radiance, 1, 1), sensor.expose(radiance, 1, 1)), 0);
}

TEST(Sensor, LosesLightInTheCorners) {
  SensorOptions options = linear_sensor();
  options.vignetting = 0.4;
  const cv::Size size(201, 201);
  const cv::Mat image = Sensor(options, size).expose(cv::Mat(size, CV_32F, cv::Scalar(0.5)), 1, 1);
  EXPECT_NEAR(cv::mean(image(cv::Rect(95, 95, 11, 11)))[0], 127.5, 2);
  EXPECT_NEAR(cv::mean(image(cv::Rect(0, 0, 5, 5)))[0], 0.6 * 127.5, 3);
}

TEST(Sensor, ExposureBringsTheMeanToItsGoalAndFollowsChanges) {
  for (const SensorOptions& options : {SensorOptions(), SensorOptions::dim()}) {
    const cv::Size size(320, 240);
    const Sensor sensor(options, size);
    for (const double light : {0.05, 0.5, 3.0}) {
      const cv::Mat radiance(size, CV_32F, cv::Scalar(light));
      const double gain = sensor.gain_for(metered_mean(radiance));
      EXPECT_NEAR(cv::mean(sensor.expose(radiance, gain, 1))[0], options.mean_gray,
                  0.05 * options.mean_gray + 1);
    }
    std::vector<double> means(40, 1.0);
    std::fill(means.begin() + 10, means.end(), 0.25);
    const auto gains = controlled_gains(sensor, options, means, 0.05);
    EXPECT_DOUBLE_EQ(gains[9], gains[0]);
    EXPECT_LT(gains[10], 1.5 * gains[0]);          // lags behind
    EXPECT_NEAR(gains.back() / gains[0], 4, 0.1);  // and arrives
  }
}

TEST(Lighting, StylesDoWhatTheySay) {
  double low = 10, high = 0, sweep_low = 10, sweep_high = 0;
  for (double t = 0; t < 20; t += 0.05) {
    EXPECT_EQ(flicker_factor(LightingStyle::kConstant, t, 1), 1);
    EXPECT_EQ(lamp_weights(LightingStyle::kFlicker, t), std::vector<float>(4, 1.0F));
    low = std::min(low, flicker_factor(LightingStyle::kFlicker, t, 1));
    high = std::max(high, flicker_factor(LightingStyle::kFlicker, t, 1));
    const auto weights = lamp_weights(LightingStyle::kSweep, t);
    sweep_low = std::min<double>(sweep_low, weights[2]);
    sweep_high = std::max<double>(sweep_high, weights[2]);
  }
  EXPECT_LT(low, 0.5);
  EXPECT_GT(high, 1.2);
  EXPECT_LT(sweep_low, 0.2);
  EXPECT_GT(sweep_high, 2);
  EXPECT_THROW(parse_lighting_style("candle"), InputError);
}

TEST(Sensor, RefusesOptionsThatMakeNoSense) {
  SensorOptions options;
  options.gamma = 0;
  EXPECT_THROW(options.check(), InputError);
  options = {};
  options.full_scale_electrons = 0;
  EXPECT_THROW(options.check(), InputError);
  options = {};
  options.mean_gray = 300;
  EXPECT_THROW(options.check(), InputError);
}

}  // namespace
}  // namespace rover
