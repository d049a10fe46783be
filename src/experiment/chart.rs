//! The bar chart of an experiment, in the manner of the thesis' figures 6.1 to 6.4, as SVG.

use std::fmt::Write;

use crate::experiment::report::TAKES_ALL;
use crate::experiment::{FRAME_RATES, Method, Report, ThesisRow};

/// Layout in pixels: the edges of the plot, the width of a bar, and the gap between groups of bars.
const LEFT: f64 = 70.0;
const TOP: f64 = 92.0;
const BOTTOM: f64 = 452.0;
const BAR: f64 = 34.0;
const GAP: f64 = 44.0;
/// Height of a row of the legend.
const LEGEND_ROW: f64 = 18.0;
/// Room at the right of the bars for the names of the frame rates.
const RIGHT: f64 = 96.0;

/// A bar: name, colour, height, and the 99th percentile of its values.
struct Bar {
    name: String,
    colour: String,
    value_ms: f64,
    percentile_99_ms: Option<f64>,
}

/// Draws the chart: a group of bars for each tile size, on a logarithmic scale, since the bars differ by factors of
/// hundreds.
pub(super) fn chart(report: &Report) -> String {
    let groups: Vec<(u32, Vec<Bar>)> =
        report.walks.iter().map(|walk| (walk.tile_cells, bars(report, walk.tile_cells))).collect();
    let values = || {
        let bars = groups.iter().flat_map(|(_, bars)| bars);
        bars.flat_map(|bar| [Some(bar.value_ms), bar.percentile_99_ms]).flatten()
    };
    // Whole decades that hold all bars and all frames.
    let low = values().chain([10.0]).fold(f64::INFINITY, f64::min).log10().floor();
    let high = values().chain([100.0]).fold(0.0, f64::max).log10().ceil();
    let y = |ms: f64| BOTTOM - (ms.log10() - low) / (high - low) * (BOTTOM - TOP);
    let plot_width = groups.iter().map(|(_, bars)| bars.len() as f64 * BAR + GAP).sum::<f64>().max(480.0);
    let legend = legend(&groups, plot_width);
    // Each row of the legend after the second moves the plot down.
    let lowered = legend.len().saturating_sub(2) as f64 * LEGEND_ROW;
    let (width, height) = (LEFT + plot_width + RIGHT, BOTTOM + 60.0 + lowered);
    let right = LEFT + plot_width;
    let mut svg = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" \
         height=\"{height}\" font-family=\"sans-serif\" font-size=\"12\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#ffffff\"/>\n\
         <text x=\"{LEFT}\" y=\"26\" font-size=\"17\" font-weight=\"bold\">Time of an expansion by tile size</text>\n"
    );
    draw_legend(&mut svg, &legend);
    writeln!(svg, "<g transform=\"translate(0 {lowered})\">").expect(TAKES_ALL);
    // Draw the lines of the decades.
    for decade in low as i32..=high as i32 {
        let at = y(10f64.powi(decade));
        let label = 10f64.powi(decade);
        draw_level(&mut svg, at, right, "stroke=\"#dddddd\"");
        draw_text(&mut svg, [LEFT - 8.0, at + 4.0], " text-anchor=\"end\"", &label.to_string());
    }
    writeln!(
        svg,
        "<text transform=\"translate(20 {:.1}) rotate(-90)\" text-anchor=\"middle\">milliseconds, logarithmic</text>",
        f64::midpoint(TOP, BOTTOM),
    )
    .expect(TAKES_ALL);
    // Draw the bars, with their values above and a whisker to the 99th percentile.
    let mut x = LEFT + GAP / 2.0;
    for (cells, bars) in &groups {
        let middle = x + bars.len() as f64 * BAR / 2.0;
        for bar in bars {
            draw_bar(&mut svg, bar, x, &y);
            x += BAR;
        }
        let size = format!("{cells}x{cells}");
        draw_text(&mut svg, [middle, BOTTOM + 20.0], " text-anchor=\"middle\" font-size=\"13\"", &size);
        x += GAP;
    }
    draw_text(&mut svg, [f64::midpoint(LEFT, right), BOTTOM + 44.0], " text-anchor=\"middle\"", "tile size");
    // Draw the time of a frame at each rate, into which an expansion has to fit.
    for (rate, frame_ms) in FRAME_RATES {
        let at = y(frame_ms);
        draw_level(&mut svg, at, right, "stroke=\"#444444\" stroke-dasharray=\"5 4\"");
        draw_text(&mut svg, [right + 6.0, at + 4.0], " font-size=\"11\"", &format!("{rate} a second"));
    }
    svg + "</g>\n</svg>\n"
}

/// Returns the bars of a tile size: terrane's own and the baseline as measured, the thesis' as published.
fn bars(report: &Report, tile_cells: u32) -> Vec<Bar> {
    let measured = report.configurations().filter(|(cells, record)| *cells == tile_cells && record.milliseconds.n > 0);
    let measured = measured.map(|(_, record)| Bar {
        name: match record.configuration.method {
            Method::Baseline => "baseline here, 1 thread".into(),
            _ => format!("terrane, {}", record.configuration.name()),
        },
        colour: record.configuration.colour(),
        value_ms: record.milliseconds.mean,
        percentile_99_ms: Some(record.milliseconds.percentile_99),
    });
    let told = ThesisRow::of(tile_cells).into_iter().flat_map(|row| {
        let bar = |name: &str, colour: &str, value_ms| Bar {
            name: name.into(),
            colour: colour.into(),
            value_ms,
            percentile_99_ms: None,
        };
        let cpu = [
            bar("thesis CPU, agents", "#5b5b5b", row.cpu_ms),
            bar("thesis CPU, no agents", "#a8a8a8", row.cpu_without_agents_ms),
        ];
        // Show the thesis' GPU only beside one that was measured here.
        let gpu = report.gpu.as_ref().map(|_| {
            [
                bar("thesis GPU, agents", "#3c3c3c", row.gpu_ms()),
                bar("thesis GPU, no agents", "#8a8a8a", row.gpu_without_agents_ms),
            ]
        });
        cpu.into_iter().chain(gpu.into_iter().flatten())
    });
    measured.chain(told).collect()
}

/// Draws a line across the plot.
fn draw_level(svg: &mut String, at: f64, right: f64, stroke: &str) {
    writeln!(svg, "<line x1=\"{LEFT}\" x2=\"{right}\" y1=\"{at:.1}\" y2=\"{at:.1}\" {stroke}/>").expect(TAKES_ALL);
}

/// Draws a text with further attributes, each with a space before it.
fn draw_text(svg: &mut String, [x, y]: [f64; 2], attributes: &str, text: &str) {
    writeln!(svg, "<text x=\"{x:.1}\" y=\"{y:.1}\"{attributes}>{text}</text>").expect(TAKES_ALL);
}

fn draw_bar(svg: &mut String, bar: &Bar, x: f64, y: &impl Fn(f64) -> f64) {
    let top = y(bar.value_ms);
    let middle = x + BAR / 2.0;
    writeln!(
        svg,
        "<rect x=\"{:.1}\" y=\"{top:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"{}\"/>",
        x + 1.0,
        BAR - 2.0,
        BOTTOM - top,
        bar.colour,
    )
    .expect(TAKES_ALL);
    let whisker = bar.percentile_99_ms.map_or(top, y);
    // A whisker shorter than half a pixel would be a blot on the bar.
    if whisker < top - 0.5 {
        writeln!(
            svg,
            "<path d=\"M{middle:.1} {top:.1}V{whisker:.1}M{:.1} {whisker:.1}h10\" stroke=\"#000000\" fill=\"none\"/>",
            middle - 5.0,
        )
        .expect(TAKES_ALL);
    }
    // Three digits say all that a bar can show.
    let decimals = (2 - bar.value_ms.log10().floor() as i32).clamp(0, 3) as usize;
    let value = format!("{:.decimals$}", bar.value_ms);
    draw_text(svg, [middle, whisker.min(top) - 4.0], " text-anchor=\"middle\" font-size=\"10\"", &value);
}

/// Returns one bar of each name, in rows of as many as there is room for.
fn legend(groups: &[(u32, Vec<Bar>)], plot_width: f64) -> Vec<Vec<&Bar>> {
    let mut named: Vec<&Bar> = Vec::new();
    for bar in groups.iter().flat_map(|(_, bars)| bars) {
        if named.iter().all(|known| known.name != bar.name) {
            named.push(bar);
        }
    }
    let columns = ((plot_width + RIGHT) / legend_column(&named)) as usize;
    named.chunks(columns.clamp(1, 3)).map(<[&Bar]>::to_vec).collect()
}

/// Returns the width of a column of the legend in pixels.
fn legend_column(named: &[&Bar]) -> f64 {
    // A letter of 12 pixels is 6.2 pixels wide on average.
    let longest = named.iter().map(|bar| bar.name.chars().count()).max().unwrap_or(0);
    (24.0 + 6.2 * longest as f64).max(170.0)
}

/// Draws the names of all bars, in rows under the title.
fn draw_legend(svg: &mut String, legend: &[Vec<&Bar>]) {
    let column = legend_column(&legend.concat());
    for (row, bars) in legend.iter().enumerate() {
        for (number, bar) in bars.iter().enumerate() {
            let (x, y) = (LEFT + number as f64 * column, 44.0 + row as f64 * LEGEND_ROW);
            write!(svg, "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"11\" height=\"11\" fill=\"{}\"/>", bar.colour)
                .expect(TAKES_ALL);
            draw_text(svg, [x + 16.0, y + 10.0], "", &bar.name);
        }
    }
}
