#pragma once

namespace rover {

class Canvas;

// Surfaces that people have printed, drawn or built on, each over the whole canvas.
void paint_poster(Canvas& canvas, double tone);
void paint_play_mat(Canvas& canvas, double tone);
void paint_board(Canvas& canvas, double tone);
void paint_cardboard(Canvas& canvas, double tone);
void paint_book(Canvas& canvas, double tone);
void paint_stripes(Canvas& canvas);
void paint_facade(Canvas& canvas, double tone);
void paint_shop(Canvas& canvas, double tone);

}  // namespace rover
