//! Tables of text: columns that know their cells.

use serde::Serialize;

use crate::words;

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Table {
    pub id: &'static str,
    pub caption: String,
    pub columns: Vec<Head>,
    /// Cells by row, one per column.
    pub rows: Vec<Vec<String>>,
    /// Explanations below the table.
    pub notes: Vec<String>,
}

#[derive(Debug, Clone, PartialEq, Serialize)]
pub(crate) struct Head {
    pub name: String,
    pub class: Class,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Class {
    /// Names, flush left, on one line.
    Label,
    /// Figures, flush right.
    Figure,
    /// Text that may be long: flush left, on several lines.
    Prose,
}

pub(crate) struct Column<'a, T> {
    head: Head,
    cell: Box<dyn Fn(&T) -> String + 'a>,
}

pub(crate) fn column<'a, T>(
    class: Class,
    name: impl Into<String>,
    cell: impl Fn(&T) -> String + 'a,
) -> Column<'a, T> {
    Column { head: Head { name: name.into(), class }, cell: Box::new(cell) }
}

pub(crate) fn label<'a, T>(
    name: impl Into<String>,
    cell: impl Fn(&T) -> String + 'a,
) -> Column<'a, T> {
    column(Class::Label, name, cell)
}

pub(crate) fn figure<'a, T>(
    name: impl Into<String>,
    cell: impl Fn(&T) -> String + 'a,
) -> Column<'a, T> {
    column(Class::Figure, name, cell)
}

/// The cell of a page without a figure.
pub(crate) const NONE: &str = "–";

impl Table {
    pub(crate) fn of<'t, T: 't>(
        id: &'static str,
        caption: impl Into<String>,
        items: impl IntoIterator<Item = &'t T>,
        columns: Vec<Column<'_, T>>,
    ) -> Self {
        let row = |item| columns.iter().map(|column| (column.cell)(item)).collect();
        let rows = items.into_iter().map(row).collect();
        let columns = columns.into_iter().map(|column| column.head).collect();
        Self { id, caption: caption.into(), columns, rows, notes: Vec::new() }
    }

    pub(crate) fn without_empty_columns(mut self) -> Self {
        for at in (0..self.columns.len()).rev() {
            if !self.rows.is_empty() && self.rows.iter().all(|row| row[at] == NONE) {
                self.columns.remove(at);
                self.rows.iter_mut().for_each(|row| _ = row.remove(at));
            }
        }
        self
    }

    /// Returns the table if it has rows, and more than `n` columns.
    pub(crate) fn if_beyond(self, n: usize) -> Option<Self> {
        (self.columns.len() > n && !self.rows.is_empty()).then_some(self)
    }

    pub(crate) fn heads(&self) -> Vec<String> {
        self.columns.iter().map(|head| head.name.clone()).collect()
    }

    pub(crate) fn text(mut self) -> String {
        let is_left = |at: &usize| self.columns[*at].class != Class::Figure;
        let left: Vec<usize> = (0..self.columns.len()).filter(is_left).collect();
        self.rows.insert(0, self.heads());
        words::align(&self.rows, &left)
    }
}

/// Returns the cell of a value that may be unknown.
pub(crate) fn known<T>(value: Option<T>, in_words: impl FnOnce(T) -> String) -> String {
    value.map_or(NONE.into(), in_words)
}
