//! Lines of a capture as an SVG, as a logic analyser's program shows them: levels, the bytes of a UART above its line, and
//! spans with their length.
//!
//! Times in a picture count from its zero, so that it stays the same when only the instant changes at which the image does
//! something.

use std::collections::HashMap;
use std::fmt::Write as _;

use crate::capture::Line;

/// Width of the levels, and of the names to the left of them, px.
const WIDTH: f64 = 900.0;
const NAMES: f64 = 110.0;
/// Height of a line's row, and of its level, px.
const ROW: f64 = 58.0;
const HIGH: f64 = 26.0;
/// Height of a span's row.
const SPAN: f64 = 26.0;
/// Above the first row: the title.
const TOP: f64 = 34.0;
/// Below the last row: the time.
const BOTTOM: f64 = 30.0;
/// Edges closer than this are not drawn one by one, px.
const FINEST: f64 = 0.5;
/// A byte is named where it is at least this wide, px.
const BYTE_WIDTH: f64 = 17.0;

/// What is drawn.
#[derive(Clone, Debug)]
pub struct Picture<'a> {
    /// Above it.
    pub title: &'a str,
    /// Names of lines in the capture, with the bit rate of those that are a UART's, top down.
    pub lines: &'a [(&'a str, Option<u64>)],
    /// Begin of the time axis; these times are ns of the capture.
    pub from: u64,
    /// The time that the axis calls 0.
    pub zero: u64,
    /// The end.
    pub until: u64,
    /// Spans: what, begin and end, ns of the capture.
    pub spans: Vec<(String, u64, u64)>,
}

impl Picture<'_> {
    /// As an SVG.
    ///
    /// # Errors
    /// A line is not in the capture.
    pub fn svg(&self, capture: &HashMap<String, Line>) -> Result<String, String> {
        let rows_end = TOP + ROW * self.lines.len() as f64;
        let height = rows_end + SPAN * self.spans.len() as f64 + BOTTOM;
        let width = NAMES + WIDTH + 20.0;
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width:.0} {height:.0}\" \
             font-family=\"DejaVu Sans, Helvetica, Arial, sans-serif\" font-size=\"13\">\n\
             <title>{0}</title>\n<rect width=\"{width:.0}\" height=\"{height:.0}\" fill=\"#ffffff\"/>\n\
             <text x=\"10\" y=\"20\" font-weight=\"bold\">{0}</text>\n",
            self.title
        );
        for (row, (name, baud)) in self.lines.iter().enumerate() {
            let line =
                capture.get(*name).ok_or_else(|| format!("there is no line `{name}` in the capture"))?;
            self.line(&mut svg, name, line, *baud, TOP + ROW * row as f64);
        }
        for (row, (what, from, until)) in self.spans.iter().enumerate() {
            self.span(&mut svg, what, (*from, *until), rows_end + SPAN * row as f64);
        }
        self.axis(&mut svg, height - BOTTOM);
        svg.push_str("</svg>\n");
        Ok(svg)
    }

    fn x(&self, at: u64) -> f64 {
        let at = at.clamp(self.from, self.until);
        NAMES + (at - self.from) as f64 / (self.until - self.from) as f64 * WIDTH
    }

    fn line(&self, svg: &mut String, name: &str, line: &Line, baud: Option<u64>, top: f64) {
        let y = |high: bool| top + if high { ROW - 10.0 - HIGH } else { ROW - 10.0 };
        let mut path = format!("M{:.1} {:.1}", self.x(self.from), y(line.level(self.from)));
        let first = line.changes.partition_point(|&(at, _)| at <= self.from);
        let (mut last, mut hidden) = (f64::NEG_INFINITY, None);
        for &(at, high) in line.changes.iter().skip(first).take_while(|&&(at, _)| at < self.until) {
            let x = self.x(at);
            // Edges that are closer than the eye sees make a surface as one does; the level after them holds.
            if x - last >= FINEST {
                if let Some(before) = hidden {
                    put(&mut path, format_args!("V{:.1}", y(before)));
                }
                put(&mut path, format_args!("H{x:.1}V{:.1}", y(high)));
                (last, hidden) = (x, None);
            } else {
                hidden = Some(high);
            }
        }
        if let Some(high) = hidden {
            put(&mut path, format_args!("V{:.1}", y(high)));
        }
        put(&mut path, format_args!("H{:.1}", self.x(self.until)));
        let colour = if baud.is_some() { "#0b5cad" } else { "#222222" };
        put(
            svg,
            format_args!(
                "<text x=\"10\" y=\"{:.1}\">{name}</text>\n<path d=\"{path}\" fill=\"none\" stroke=\"{colour}\" \
                 stroke-width=\"1.3\"/>\n",
                top + ROW - 18.0
            ),
        );
        for (start, end, byte) in baud.map_or_else(Vec::new, |baud| line.bytes(self.from, self.until, baud)) {
            let (left, right) = (self.x(start), self.x(end));
            if right - left >= BYTE_WIDTH {
                let (middle, top) = ((left + right) / 2.0, top + ROW - 14.0 - HIGH);
                put(
                    svg,
                    format_args!(
                        "<text x=\"{middle:.1}\" y=\"{top:.1}\" font-size=\"11\" text-anchor=\"middle\" \
                         fill=\"#0b5cad\">{byte:02x}</text>\n"
                    ),
                );
            }
        }
    }

    fn span(&self, svg: &mut String, what: &str, (from, until): (u64, u64), top: f64) {
        let (left, right, y) = (self.x(from), self.x(until), top + SPAN - 8.0);
        // Beside the span, on the side where there is room.
        let (x, anchor) =
            if right < NAMES + WIDTH / 2.0 { (right + 8.0, "start") } else { (left - 8.0, "end") };
        for x in [left, right] {
            put(
                svg,
                format_args!(
                    "<path d=\"M{x:.1} {TOP:.1}V{:.1}\" stroke=\"#b3261e\" stroke-dasharray=\"3 3\"/>\n",
                    y + 4.0
                ),
            );
        }
        put(
            svg,
            format_args!(
                "<path d=\"M{left:.1} {y:.1}H{right:.1}\" stroke=\"#b3261e\" stroke-width=\"2\"/>\n\
                 <text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"{anchor}\" fill=\"#b3261e\">{what}</text>\n",
                y + 4.0
            ),
        );
    }

    /// Ten ticks at most, at round times.
    fn axis(&self, svg: &mut String, y: f64) {
        let span = self.until - self.from;
        let steps = (0..).flat_map(|power| [1, 2, 5].map(|digit| digit * 10_u64.pow(power)));
        let step = steps.into_iter().find(|step| span / step <= 10).unwrap_or(span);
        put(svg, format_args!("<path d=\"M{NAMES:.1} {y:.1}h{WIDTH:.1}\" stroke=\"#888888\"/>\n"));
        let before = (self.zero - self.from) / step;
        let mut at = self.zero - before * step;
        while at <= self.until {
            let x = self.x(at);
            let time = at as f64 - self.zero as f64;
            put(
                svg,
                format_args!(
                    "<path d=\"M{x:.1} {y:.1}v5\" stroke=\"#888888\"/>\n<text x=\"{x:.1}\" y=\"{:.1}\" font-size=\"11\" \
                     text-anchor=\"middle\" fill=\"#555555\">{}</text>\n",
                    y + 18.0,
                    time_text(time, step)
                ),
            );
            at += step;
        }
    }
}

/// A time in the unit of the step.
fn time_text(ns: f64, step: u64) -> String {
    let (unit, name) = match step {
        0..1_000 => (1.0, "ns"),
        1_000..1_000_000 => (1e3, "us"),
        1_000_000..1_000_000_000 => (1e6, "ms"),
        _ => (1e9, "s"),
    };
    format!("{:.0} {name}", ns / unit)
}

fn put(text: &mut String, what: std::fmt::Arguments<'_>) {
    // Writing to a string cannot fail.
    let _ = text.write_fmt(what);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_has_levels_bytes_spans_and_times() {
        // 0x55 at 1 Mbit/s from 10 us on.
        let changes = (0..10).map(|bit| (10_000 + bit * 1_000, bit % 2 == 1)).collect();
        let pair = Line { initial: true, changes };
        let capture = HashMap::from([("pair".to_owned(), pair)]);
        let picture = Picture {
            title: "One byte",
            lines: &[("pair", Some(1_000_000))],
            from: 0,
            zero: 10_000,
            until: 30_000,
            spans: vec![("a byte".to_owned(), 10_000, 20_000)],
        };
        let svg = picture.svg(&capture).unwrap();
        for part in [">55</text>", ">a byte</text>", ">-10 us</text>", ">0 us</text>", ">20 us</text>"] {
            assert!(svg.contains(part), "{part}: {svg}");
        }
        // From the left edge at 110: 10 us of 30 are a third of 900.
        assert!(svg.contains("M110.0 56.0H410.0V82.0H440.0V56.0"), "{svg}");
        assert!(picture.svg(&HashMap::new()).is_err());
    }
}
