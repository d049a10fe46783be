//! Results of the experiment for readers: tables, the report, and all files in their folder.

use std::fmt::Write;
use std::path::Path;

use crate::error::Error;
use crate::experiment::chart::chart;
use crate::experiment::{
    Configuration, Engine, FRAME_RATES, Machine, Method, MethodRecord, Report, Step, ThesisRow, WalkResult,
};
use crate::export::Bytes;
use crate::file::{remove_unfinished, sync_folder, write_whole};

/// Names of all files that an experiment writes.
pub const FILES: [&str; 5] = ["expansions.csv", "summary.json", "report.md", "chart.svg", "walk.png"];

/// Writes all files into a folder that exists; each appears whole, and replaces an older one.
///
/// # Errors
/// When a file cannot be written.
pub fn write_files(out: &Path, report: &Report, walks: &[WalkResult]) -> Result<(), Error> {
    remove_unfinished(out)?;
    let mut json = serde_json::to_string_pretty(report).expect("a report is JSON");
    json.push('\n');
    // Show the largest tiles: the same way over smaller ones is a thinner strip.
    let picture = walks.iter().max_by_key(|walk| walk.tile_cells).map_or_else(Vec::new, |walk| walk.picture.to_png());
    let contents =
        [expansions_csv(walks).into(), json.into(), report.to_markdown().into(), chart(report).into(), picture];
    for (name, content) in FILES.into_iter().zip(contents) {
        write_whole(out.join(name), &content)?;
    }
    sync_folder(out)
}

/// Writes every expansion as a line of CSV.
fn expansions_csv(walks: &[WalkResult]) -> String {
    let mut csv = String::from("tile_cells,method,index,time_s,tiles,milliseconds\n");
    for walk in walks {
        for series in &walk.series {
            for (index, timing) in series.timings.iter().enumerate() {
                let (cells, method) = (walk.tile_cells, series.configuration.name());
                let (time_s, tiles, elapsed_ms) = (timing.time_s, timing.tiles, timing.elapsed_ms);
                writeln!(csv, "{cells},{method},{index},{time_s:.3},{tiles},{elapsed_ms:.6}").expect(TAKES_ALL);
            }
        }
    }
    csv
}

/// Message for `expect`: writing into a String cannot fail.
pub(super) const TAKES_ALL: &str = "a String takes everything";

impl Report {
    /// Returns the tables as plain text: timings, real time, t-tests and stages.
    pub fn to_text(&self) -> String {
        let tables = [self.timings(), self.real_time(), self.tests(), self.stages()];
        let parts = tables.map(|table| table.to_text());
        format!("{}\n\n{}", self.conditions(), parts.join("\n"))
    }

    /// Returns the report as Markdown.
    pub fn to_markdown(&self) -> String {
        let mut text = format!("# Experiment\n\n{}.\n", self.conditions());
        let parts = [
            (
                "Milliseconds an expansion",
                "The thesis' figures are those of its CPU (Core i7-2600K) or GPU (GeForce GTX 460), tables 6.1 to 6.4, with \
                 agents beside `agents` and without beside the others; without agents it tells no groups of its GPU. `x baseline` \
                 is the baseline's mean divided by the row's, `x median` the same of medians. Where there are more layers, or \
                 tiles are made one by one, an expansion is another thing than in the thesis, and stands beside nothing.",
                self.timings(),
            ),
            (
                "Real time",
                "`yes`: 99 of 100 expansions fit into a frame. `mean`: they do on average. The frames are the thesis' \
                 (table 7.1).",
                self.real_time(),
            ),
            (
                "t-tests",
                "Unpaired and two-tailed. p: how probable such a difference of the means is if there is none. The \
                 thesis' table 7.2 has Student's test of its CPU against its GPU, here for comparison; Welch's does \
                 not take the variances for the same, which they are not.",
                self.tests(),
            ),
            ("Where the time goes", "Processor time of the stages, added up over all threads.", self.stages()),
        ];
        for (title, about, table) in parts {
            write!(text, "\n## {title}\n\n{about}\n\n{}", table.to_markdown()).expect(TAKES_ALL);
        }
        text + "\n## Pictures\n\n![Milliseconds an expansion](chart.svg)\n\n\
            The walk over the largest tiles from above: from violet to yellow by order of making, rivers blue, roads \
            brown, the camera's track white from the ring on.\n\n![The walk](walk.png)\n"
    }

    /// Returns the conditions of the measurement in one sentence.
    fn conditions(&self) -> String {
        let Machine { processor, simd, memory_bytes, system, peak_bytes } = &self.machine;
        format!(
            "terrane {} on {}{} ({simd}, {} threads; baseline 1 thread), {}{system}: {} minutes at {} m/s with a turn of 90 degrees \
             each minute{}",
            self.terrane,
            processor.as_deref().unwrap_or("an unknown processor"),
            self.gpu.as_ref().map_or_else(String::new, |gpu| format!(" and {gpu}")),
            self.threads,
            memory_bytes.map_or_else(String::new, |bytes| format!("{} of memory, ", Bytes(bytes))),
            self.minutes,
            self.speed_m_s,
            peak_bytes.map_or_else(String::new, |bytes| format!("; at most {} of memory in use", Bytes(bytes))),
        )
    }

    /// Returns all configurations, each with its tile size.
    pub(super) fn configurations(&self) -> impl Iterator<Item = (u32, &MethodRecord)> {
        self.walks.iter().flat_map(|walk| walk.methods.iter().map(move |method| (walk.tile_cells, method)))
    }

    fn timings(&self) -> Table {
        let header =
            ["tile", "method", "n", "tiles", "mean", "sd", "median", "p99", "max", "thesis", "x baseline", "x median"];
        let row = |(cells, record): (u32, &MethodRecord)| {
            let summary = &record.milliseconds;
            vec![
                format!("{cells}x{cells}"),
                record.configuration.name(),
                summary.n.to_string(),
                number(record.tiles, 2),
                number(summary.mean, 3),
                number(summary.standard_deviation, 3),
                number(summary.median, 3),
                number(summary.percentile_99, 3),
                number(summary.greatest, 3),
                record.thesis_ms.map_or("-".into(), |thesis_ms| thesis_ms.to_string()),
                number(record.speedup, 1),
                number(record.speedup_of_medians, 1),
            ]
        };
        Table::new(&header, self.configurations().map(row))
    }

    fn real_time(&self) -> Table {
        let rates = FRAME_RATES.map(|(rate, frame_ms)| format!("{rate} a second ({frame_ms} ms)"));
        let header: Vec<&str> = ["tile", "method"].into_iter().chain(rates.iter().map(|rate| &rate[..])).collect();
        let row = |(cells, record): (u32, &MethodRecord)| {
            let verdict = record.real_time.iter().map(|frame| match (frame.by_percentile_99, frame.by_mean) {
                (true, _) => "yes".to_owned(),
                (false, true) => "mean".to_owned(),
                (false, false) => "no".to_owned(),
            });
            [format!("{cells}x{cells}"), record.configuration.name()].into_iter().chain(verdict).collect()
        };
        Table::new(&header, self.configurations().map(row))
    }

    fn tests(&self) -> Table {
        let header =
            ["tile", "first", "second", "Welch t", "freedom", "Welch p", "Student t", "Student p", "thesis CPU/GPU p"];
        let rows = self.walks.iter().flat_map(|walk| {
            walk.comparisons.iter().map(|comparison| {
                let (welch, student) = (comparison.welch, comparison.student);
                let cells = walk.tile_cells;
                vec![
                    format!("{cells}x{cells}"),
                    comparison.first.name(),
                    comparison.second.name(),
                    number(welch.map(|test| test.t), 2),
                    number(welch.map(|test| test.freedom), 1),
                    probability(welch.map(|test| test.p)),
                    number(student.map(|test| test.t), 2),
                    probability(student.map(|test| test.p)),
                    probability(ThesisRow::of(cells).map(|row| row.p)),
                ]
            })
        });
        Table::new(&header, rows)
    }

    fn stages(&self) -> Table {
        let rows = self.configurations().flat_map(|(cells, record)| {
            record.stages.iter().map(move |stage| {
                vec![
                    format!("{cells}x{cells}"),
                    record.configuration.name(),
                    stage.stage.clone(),
                    number(stage.milliseconds, 3),
                    number(stage.share * 100.0, 1),
                ]
            })
        });
        Table::new(&["tile", "method", "stage", "ms an expansion", "percent"], rows)
    }
}

impl Configuration {
    /// Returns the colour of the configuration's bars: that of its method and engine, blended with other colours for
    /// layers, steps and threads that differ from the thesis.
    pub(super) fn colour(self) -> String {
        let [mut red, mut green, mut blue] = match (self.method, self.engine) {
            (Method::Agents, Engine::Cpu) => [0x1f, 0x6f, 0x8b],
            (Method::NoAgents, Engine::Cpu) => [0x7f, 0xb7, 0xbe],
            (Method::Agents, Engine::Gpu { group_side: 8 }) => [0x4b, 0x3f, 0x87],
            (Method::Agents, Engine::Gpu { group_side: 16 }) => [0x65, 0x55, 0x9f],
            (Method::Agents, Engine::Gpu { .. }) => [0x82, 0x73, 0xb8],
            (Method::NoAgents, Engine::Gpu { group_side: 8 }) => [0xa6, 0x8b, 0xc9],
            (Method::NoAgents, Engine::Gpu { group_side: 16 }) => [0xbb, 0xa6, 0xd8],
            (Method::NoAgents, Engine::Gpu { .. }) => [0xd2, 0xc4, 0xe6],
            (Method::Baseline, _) => [0xb5, 0x48, 0x3a],
        };
        let mut mix = |towards: [i32; 3], percent: i32| {
            for (channel, towards) in [&mut red, &mut green, &mut blue].into_iter().zip(towards) {
                *channel += (towards - *channel) * percent / 100;
            }
        };
        if self.method != Method::Baseline {
            // More layers are darker, tile by tile is green, and a set number of threads is yellow, more so for fewer.
            mix([0x10, 0x10, 0x10], (40 * (self.layers as i32 - 1)).min(70));
            mix([0x4f, 0x8f, 0x2f], if self.step == Step::One { 55 } else { 0 });
            mix([0xf2, 0xc1, 0x4e], self.threads.map_or(0, |threads| 60 - 3 * threads.min(12) as i32));
        }
        format!("#{red:02x}{green:02x}{blue:02x}")
    }
}

/// Formats a number with some decimals; a dash where there is none.
fn number(value: impl Into<Option<f64>>, decimals: usize) -> String {
    value.into().filter(|value| value.is_finite()).map_or("-".into(), |value| format!("{value:.decimals$}"))
}

/// Formats a probability: a dash where there is none, and an upper bound where it is too small for a number.
fn probability(p: Option<f64>) -> String {
    match p {
        None => "-".into(),
        Some(0.0) => "< 1e-300".into(),
        Some(p) if p < 0.001 => format!("{p:.1e}"),
        Some(p) => format!("{p:.3}"),
    }
}

/// Rows of words under a header.
struct Table {
    rows: Vec<Vec<String>>,
}

impl Table {
    fn new(header: &[&str], rows: impl Iterator<Item = Vec<String>>) -> Table {
        let header = header.iter().map(ToString::to_string).collect();
        Table { rows: std::iter::once(header).chain(rows).collect() }
    }

    fn widths(&self) -> Vec<usize> {
        let columns = self.rows[0].len();
        let width = |column: usize| self.rows.iter().map(|row| row[column].chars().count()).max().unwrap_or(0);
        (0..columns).map(width).collect()
    }

    /// Returns the table as text in columns: words to the left, numbers to the right.
    fn to_text(&self) -> String {
        self.lines(|cells| format!("{}\n", cells.join("  ").trim_end()))
    }

    fn to_markdown(&self) -> String {
        let mut text = self.lines(|cells| format!("| {} |\n", cells.join(" | ")));
        let dashes: Vec<String> = self.widths().into_iter().map(|width| "-".repeat(width)).collect();
        let end_of_header = text.find('\n').map_or(0, |at| at + 1);
        // Markdown needs a line of dashes under the header.
        text.insert_str(end_of_header, &format!("| {} |\n", dashes.join(" | ")));
        text
    }

    fn lines(&self, line: impl Fn(Vec<String>) -> String) -> String {
        let widths = self.widths();
        let is_number =
            |column: usize| self.rows[1..].iter().all(|row| row[column].parse::<f64>().is_ok() || row[column] == "-");
        let numbers: Vec<bool> = (0..widths.len()).map(is_number).collect();
        let cell = |(column, text): (usize, &String)| match numbers[column] {
            true => format!("{text:>0$}", widths[column]),
            false => format!("{text:<0$}", widths[column]),
        };
        self.rows.iter().map(|row| line(row.iter().enumerate().map(cell).collect())).collect()
    }
}
