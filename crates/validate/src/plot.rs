//! Line plots as SVG text: two axes, series told apart by colour and by marker, a legend. No font file is read.
//!
//! Colours are those of M. Okabe and K. Ito, *Color Universal Design*, 2008, which colour-blind readers can tell apart.

use std::fmt::Write;

const WIDTH: f64 = 700.0;
const HEIGHT: f64 = 430.0;
/// Left, right, top and bottom of the axes.
const FRAME: [f64; 4] = [78.0, 682.0, 40.0, 372.0];
const COLOURS: [&str; 6] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#000000"];

/// How a series is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Style {
    /// Markers joined by a line.
    Line,
    /// Markers alone.
    Markers,
    /// A line without markers, dashed: theory.
    Theory,
}

/// Points under one name.
#[derive(Clone, Debug)]
pub struct Series {
    /// For the legend.
    pub name: String,
    /// How it is drawn.
    pub style: Style,
    /// Index of colour and marker.
    pub look: usize,
    /// (x, y).
    pub points: Vec<(f64, f64)>,
}

/// An axis.
#[derive(Clone, Debug)]
pub struct Axis {
    /// What it shows, with its unit.
    pub label: &'static str,
    /// First and last value.
    pub range: [f64; 2],
    /// True: logarithmic, one label a decade. False: linear, five steps.
    pub logarithmic: bool,
}

/// Where the legend stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Corner {
    /// Lower left.
    LowerLeft,
    /// Upper left.
    UpperLeft,
    /// Upper right.
    UpperRight,
}

/// A plot.
#[derive(Clone, Debug)]
pub struct Plot {
    /// Above the axes.
    pub title: String,
    /// Horizontal.
    pub x: Axis,
    /// Vertical.
    pub y: Axis,
    /// In order of the legend.
    pub series: Vec<Series>,
    /// Place of the legend.
    pub legend: Corner,
}

impl Plot {
    /// The picture, 700 × 430.
    pub fn svg(&self) -> String {
        let mut out = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{HEIGHT}\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" \
             font-family=\"Helvetica, Arial, DejaVu Sans, sans-serif\" font-size=\"13\" fill=\"#222\">\n\
             <rect width=\"{WIDTH}\" height=\"{HEIGHT}\" fill=\"#fff\"/>\n"
        );
        let [left, right, top, bottom] = FRAME;
        let middle = 0.5 * (left + right);
        text(&mut out, middle, 24.0, "middle", &format!("<tspan font-size=\"15\">{}</tspan>", escape(&self.title)));
        self.grid(&mut out);
        text(&mut out, middle, HEIGHT - 14.0, "middle", &escape(self.x.label));
        let centre = 0.5 * (top + bottom);
        let _ = writeln!(
            out,
            "<text x=\"18\" y=\"{centre}\" text-anchor=\"middle\" transform=\"rotate(-90 18 {centre})\">{}</text>",
            escape(self.y.label)
        );
        let _ = writeln!(
            out,
            "<clipPath id=\"axes\"><rect x=\"{left}\" y=\"{top}\" width=\"{}\" height=\"{}\"/></clipPath>",
            right - left,
            bottom - top
        );
        for series in &self.series {
            self.series(&mut out, series);
        }
        self.legend(&mut out);
        out.push_str("</svg>\n");
        out
    }

    fn place(&self, (x, y): (f64, f64)) -> (f64, f64) {
        let [left, right, top, bottom] = FRAME;
        (left + (right - left) * self.x.share(x), bottom + (top - bottom) * self.y.share(y))
    }

    fn grid(&self, out: &mut String) {
        let [left, right, top, bottom] = FRAME;
        for (value, label) in self.x.ticks() {
            let x = self.place((value, self.y.range[0])).0;
            line(out, [x, top, x, bottom], if label.is_some() { "#ccc" } else { "#eee" });
            label.iter().for_each(|l| text(out, x, bottom + 20.0, "middle", l));
        }
        for (value, label) in self.y.ticks() {
            let y = self.place((self.x.range[0], value)).1;
            line(out, [left, y, right, y], if label.is_some() { "#ccc" } else { "#eee" });
            label.iter().for_each(|l| text(out, left - 8.0, y + 4.5, "end", l));
        }
        let _ = writeln!(
            out,
            "<rect x=\"{left}\" y=\"{top}\" width=\"{}\" height=\"{}\" fill=\"none\" stroke=\"#444\"/>",
            right - left,
            bottom - top
        );
    }

    fn series(&self, out: &mut String, series: &Series) {
        let colour = COLOURS[series.look % COLOURS.len()];
        let places: Vec<(f64, f64)> = series.points.iter().map(|&p| self.place(p)).collect();
        out.push_str("<g clip-path=\"url(#axes)\">\n");
        if series.style != Style::Markers {
            let path: Vec<String> = places.iter().map(|(x, y)| format!("{x:.1},{y:.1}")).collect();
            let dash = if series.style == Style::Theory { " stroke-dasharray=\"7 4\"" } else { "" };
            let path = path.join(" ");
            let _ = writeln!(
                out,
                "<polyline points=\"{path}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\"{dash}/>"
            );
        }
        if series.style != Style::Theory {
            places.iter().for_each(|&place| marker(out, place, series.look, colour));
        }
        out.push_str("</g>\n");
    }

    fn legend(&self, out: &mut String) {
        let [left, right, top, bottom] = FRAME;
        let longest = self.series.iter().map(|s| s.name.chars().count()).max().unwrap_or(0) as f64;
        // No font is measured: 7 units a letter is more than the usual fonts need at this size.
        let (width, height) = (54.0 + 6.6 * longest, 12.0 + 20.0 * self.series.len() as f64);
        let x = if self.legend == Corner::UpperRight { right - width - 10.0 } else { left + 10.0 };
        let y = if self.legend == Corner::LowerLeft { bottom - height - 10.0 } else { top + 10.0 };
        let _ = writeln!(
            out,
            "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" fill=\"#fff\" fill-opacity=\"0.92\" stroke=\"#bbb\"/>"
        );
        for (k, series) in self.series.iter().enumerate() {
            let (at, colour) = (y + 16.0 + 20.0 * k as f64, COLOURS[series.look % COLOURS.len()]);
            if series.style != Style::Markers {
                let dash = if series.style == Style::Theory { " stroke-dasharray=\"7 4\"" } else { "" };
                let _ = writeln!(
                    out,
                    "<line x1=\"{:.1}\" y1=\"{at:.1}\" x2=\"{:.1}\" y2=\"{at:.1}\" stroke=\"{colour}\" stroke-width=\"2\"{dash}/>",
                    x + 8.0,
                    x + 38.0
                );
            }
            if series.style != Style::Theory {
                marker(out, (x + 23.0, at), series.look, colour);
            }
            text(out, x + 46.0, at + 4.5, "start", &escape(&series.name));
        }
    }
}

impl Axis {
    fn share(&self, value: f64) -> f64 {
        let [low, high] = self.range;
        if self.logarithmic {
            libm::log(value.max(low * 1e-3) / low) / libm::log(high / low)
        } else {
            (value - low) / (high - low)
        }
    }

    /// Values, with labels where there are any.
    fn ticks(&self) -> Vec<(f64, Option<String>)> {
        let [low, high] = self.range;
        if !self.logarithmic {
            let at = |k: i32| low + (high - low) * f64::from(k) / 5.0;
            return (0..=5).map(|k| (at(k), Some(format!("{}", (at(k) * 1e6).round() / 1e6)))).collect();
        }
        let (first, last) = (libm::log10(low).floor() as i32, libm::log10(high).ceil() as i32);
        let steps = (first..=last).flat_map(|e| (1..10).map(move |m| (m, e)));
        steps
            .map(|(m, e)| (f64::from(m) * libm::pow(10.0, f64::from(e)), (m == 1).then(|| power_of_ten(e))))
            .filter(|(value, _)| (low * 0.999..=high * 1.001).contains(value))
            .collect()
    }
}

fn power_of_ten(exponent: i32) -> String {
    // Letters of their own, since not every reader places raised text well.
    let raise = |c: char| {
        if c == '-' { '⁻' } else { "⁰¹²³⁴⁵⁶⁷⁸⁹".chars().nth(c as usize - '0' as usize).unwrap_or(c) }
    };
    match exponent {
        0 => "1".to_owned(),
        1 => "10".to_owned(),
        e => format!("10{}", e.to_string().chars().map(raise).collect::<String>()),
    }
}

fn text(out: &mut String, x: f64, y: f64, anchor: &str, content: &str) {
    let _ = writeln!(out, "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{content}</text>");
}

fn line(out: &mut String, [x1, y1, x2, y2]: [f64; 4], colour: &str) {
    let _ = writeln!(out, "<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\" stroke=\"{colour}\"/>");
}

fn marker(out: &mut String, (x, y): (f64, f64), look: usize, colour: &str) {
    let polygon = |corners: &[(f64, f64)]| {
        let at: Vec<String> = corners.iter().map(|(dx, dy)| format!("{:.1},{:.1}", x + dx, y + dy)).collect();
        format!("<polygon points=\"{}\" fill=\"{colour}\"/>", at.join(" "))
    };
    let shape = match look % 4 {
        0 => format!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\" fill=\"{colour}\"/>"),
        1 => polygon(&[(-3.7, -3.7), (3.7, -3.7), (3.7, 3.7), (-3.7, 3.7)]),
        2 => polygon(&[(-4.8, 4.0), (4.8, 4.0), (0.0, -4.8)]),
        _ => polygon(&[(-5.0, 0.0), (0.0, -5.0), (5.0, 0.0), (0.0, 5.0)]),
    };
    let _ = writeln!(out, "{shape}");
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_stand_where_their_values_say() {
        let axis = |logarithmic| Axis { label: "", range: [1.0, 100.0], logarithmic };
        assert!((axis(true).share(10.0) - 0.5).abs() < 1e-12 && (axis(false).share(50.5) - 0.5).abs() < 1e-12);
        let labels: Vec<String> = axis(true).ticks().into_iter().filter_map(|t| t.1).collect();
        assert_eq!(labels.len(), 3);
        let series =
            Series { name: "a < b".into(), style: Style::Line, look: 0, points: vec![(1.0, 1.0), (100.0, 100.0)] };
        let (x, y) = (axis(true), axis(true));
        let svg = Plot { title: String::new(), x, y, series: vec![series], legend: Corner::UpperRight }.svg();
        assert!(svg.contains("points=\"78.0,372.0 682.0,40.0\"") && svg.contains("a &lt; b"));
    }
}
