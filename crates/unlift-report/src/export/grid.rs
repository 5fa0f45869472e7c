//! The cells of a table for a paper: a row per scheme, a column per kind of neighborhoods.

use crate::document::Document;
use crate::page::curves::{Choices, GivenChoice};
use crate::page::tables::percent_cell;
use crate::page::{tables, verdict};
use crate::{attack, words};

pub(super) struct Grid {
    pub caption: String,
    pub heads: Vec<String>,
    pub rows: Vec<Vec<String>>,
}

/// The cell of a figure that the audit could not measure; it must not look like a small one.
const NOT_AUDITED: &str = "not audited";

/// Returns the strongest attack per scheme and neighborhoods, and the two baselines; a cell has a figure per threshold of
/// `within`.
pub(super) fn grid(document: &Document, within: &[String]) -> Grid {
    let choices = Choices::of(document);
    let givens: Vec<&GivenChoice> = choices.givens.iter().collect();
    let all = tables::thresholds(document);
    let joined = |cell: &dyn Fn(&str) -> String| {
        within.iter().map(|typed| cell(typed)).collect::<Vec<_>>().join(" / ")
    };
    let baseline = |shares: &[Option<f64>]| {
        joined(&|typed| {
            let at = all.iter().position(|known| known == typed);
            percent_cell(at.and_then(|at| shares.get(at)?.as_ref()), None)
        })
    };
    let any_alone = choices.schemes.iter().any(|scheme| scheme.alone.iter().any(Option::is_some));
    let mut heads = vec!["scheme".to_owned()];
    heads.extend(givens.iter().map(|given| head(given)));
    heads.push("blind".to_owned());
    if any_alone {
        heads.push("records alone".to_owned());
    }
    let mut rows = Vec::new();
    for scheme in &choices.schemes {
        let cell = |given: &&GivenChoice| {
            let row =
                |typed: &str| verdict::strongest_given(document, &scheme.name, &given.given, typed);
            if within.first().is_none_or(|typed| row(typed).is_none()) {
                let refused = document.not_audited.iter().any(|refused| {
                    refused.scheme == scheme.name
                        && refused.neighbors.as_deref() == Some(&given.given.neighbors)
                });
                return if refused { NOT_AUDITED.to_owned() } else { percent_cell(None, None) };
            }
            joined(&|typed| {
                let row = row(typed);
                let spread = row.and_then(|row| row.std.as_ref()?.recovered_percent.get(typed));
                percent_cell(row.and_then(|row| row.recovered_percent.get(typed)), spread)
            })
        };
        let mut cells = vec![scheme.name.clone()];
        cells.extend(givens.iter().map(cell));
        cells.push(baseline(&scheme.blind));
        if any_alone {
            cells.push(baseline(&scheme.alone));
        }
        rows.push(cells);
    }
    for refused in document.not_audited.iter().filter(|refused| refused.neighbors.is_none()) {
        let mut cells = vec![NOT_AUDITED.to_owned(); heads.len()];
        cells[0].clone_from(&refused.scheme);
        rows.push(cells);
    }
    Grid { caption: caption(document, within), heads, rows }
}

fn caption(document: &Document, within: &[String]) -> String {
    let row = document.results.first();
    let points = row.map_or("points", |row| words::points(row.unit));
    let within: Vec<String> =
        within.iter().map(|typed| tables::threshold_text(document, typed)).collect();
    let mut text = format!(
        "Percent of the {points} recovered within {}, by the strongest attack tried. Columns: the share of right \
         neighbors in the lists of an oracle, or another source of lists; blind is a guess without neighborhoods.",
        within.join(" / ")
    );
    let repeats = document.results.iter().map(|row| row.repeats).max().unwrap_or(1);
    if repeats > 1 {
        text.push_str(&format!(" Means over {repeats} seeds."));
    }
    if within.iter().any(|text| text.ends_with('×')) {
        text.push_str(&format!(" × is times {}.", words::USUAL_DISTANCE));
    }
    text
}

/// Returns a short head: `0.5`, `0.5 (near)` or `overlap`.
fn head(choice: &GivenChoice) -> String {
    let given = &choice.given;
    match given.oracle_noise.as_deref() {
        _ if !attack::is_oracle(&given.neighbors) => choice.source.clone(),
        None | Some("uniform") => format!("{:?}", given.inlier_ratio),
        Some(noise) => format!("{:?} ({noise})", given.inlier_ratio),
    }
}

/// Returns a `tabular` with the rules of booktabs.
pub(super) fn latex(document: &Document, grid: &Grid) -> String {
    let columns = "r".repeat(grid.heads.len().saturating_sub(1));
    let line = |cells: &[String]| {
        let cells: Vec<String> = cells.iter().map(|cell| in_latex(cell)).collect();
        format!("{} \\\\\n", cells.join(" & "))
    };
    let mut text = format!(
        "% unlift {}, seed {}; \\usepackage{{booktabs}}\n% {}\n\\begin{{tabular}}{{l{columns}}}\n\\toprule\n{}\\midrule\n",
        on_one_line(&document.unlift),
        document.seed,
        on_one_line(&grid.caption),
        line(&grid.heads)
    );
    grid.rows.iter().for_each(|row| text.push_str(&line(row)));
    text + "\\bottomrule\n\\end{tabular}\n"
}

/// Returns a table in GitHub's Markdown, with figures flush right, below the caption.
pub(super) fn markdown(document: &Document, grid: &Grid) -> String {
    let line = |cells: &[String]| {
        let cells: Vec<String> = cells.iter().map(|cell| in_markdown(cell)).collect();
        format!("| {} |\n", cells.join(" | "))
    };
    // Two dashes would end the comment.
    let version = on_one_line(&document.unlift).replace("--", "- -");
    let rule = " ---: |".repeat(grid.heads.len().saturating_sub(1));
    let mut text = format!(
        "<!-- unlift {version}, seed {} -->\n{}\n\n{}| --- |{rule}\n",
        document.seed,
        in_markdown(&grid.caption),
        line(&grid.heads)
    );
    grid.rows.iter().for_each(|row| text.push_str(&line(row)));
    text
}

fn on_one_line(text: &str) -> String {
    text.chars().map(|c| if c.is_control() { ' ' } else { c }).collect()
}

fn in_latex(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in on_one_line(text).chars() {
        match c {
            '\\' => out.push_str("\\textbackslash{}"),
            '~' => out.push_str("\\textasciitilde{}"),
            '^' => out.push_str("\\textasciicircum{}"),
            '<' => out.push_str("\\textless{}"),
            '>' => out.push_str("\\textgreater{}"),
            '|' => out.push_str("\\textbar{}"),
            '&' | '%' | '$' | '#' | '_' | '{' | '}' => out.extend(['\\', c]),
            '±' => out.push_str("$\\pm$"),
            '×' => out.push_str("$\\times$"),
            '–' => out.push_str("--"),
            _ => out.push(c),
        }
    }
    out
}

fn in_markdown(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for c in on_one_line(text).chars() {
        match c {
            '<' => out.push_str("&lt;"),
            '|' | '\\' | '`' | '*' | '_' | '[' | ']' => out.extend(['\\', c]),
            _ => out.push(c),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_markup_is_escaped() {
        assert_eq!(in_latex("a_b & 5 % ± 0.7"), "a\\_b \\& 5 \\% $\\pm$ 0.7");
        assert_eq!(in_latex("\\input{x}\n"), "\\textbackslash{}input\\{x\\} ");
        assert_eq!(in_markdown("a|b <i> *c*"), "a\\|b &lt;i> \\*c\\*");
    }
}
