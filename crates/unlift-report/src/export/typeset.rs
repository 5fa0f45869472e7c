//! Writes a grid as LaTeX and as Markdown.

use super::grid::Grid;
use crate::document::Document;

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
