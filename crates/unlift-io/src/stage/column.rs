//! Converts columns of files to the types that are used here.

use crate::Error;
use arrow_array::cast::AsArray;
use arrow_array::types::{
    Float16Type, Float32Type, Float64Type, Int8Type, Int16Type, Int32Type, Int64Type, UInt8Type,
    UInt16Type, UInt32Type, UInt64Type,
};
use arrow_array::{Array, ArrayRef, RecordBatch};
use arrow_schema::DataType;
use std::fmt;
use std::ops::Range;
use std::path::Path;

/// The type that a column must have. Any width is accepted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Type {
    /// Half, single or double floats.
    Float,
    /// Signed or unsigned integers.
    Integer,
    Text,
    Floats,
    Integers,
    /// Lists of integers or floats.
    Numbers,
}

impl Type {
    pub(super) fn admits(self, found: &DataType) -> bool {
        let float = DataType::is_floating;
        match (self, found) {
            // Some tables have no decimals, and pandas converts integers with nulls to floats.
            (Self::Float | Self::Integer, found) => float(found) || found.is_integer(),
            (Self::Text, found) => *found == DataType::Utf8,
            (Self::Floats | Self::Numbers, DataType::List(of)) => {
                float(of.data_type()) || of.data_type().is_integer() || of.data_type().is_null()
            }
            // Lists that are all empty may have no type.
            (Self::Integers, DataType::List(of)) => {
                of.data_type().is_integer() || of.data_type().is_null()
            }
            (Self::Floats | Self::Integers | Self::Numbers, _) => false,
        }
    }
}

impl fmt::Display for Type {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Float => "floats",
            Self::Integer => "integers",
            Self::Text => "text",
            Self::Floats => "lists of floats",
            Self::Integers => "lists of integers",
            Self::Numbers => "lists of integers or floats",
        })
    }
}

/// Returns the column names of a vector: `foot_x`, `foot_y`, ... for `foot_`.
pub(super) fn coordinate_names<const D: usize>(prefix: &str) -> [String; D] {
    std::array::from_fn(|axis| format!("{prefix}{}", ["x", "y", "z"][axis]))
}

/// Some rows of a table. [`super::table::Table::read`] has checked that the columns exist and have
/// the right type.
#[derive(Debug)]
pub(super) struct Batch<'a> {
    path: &'a Path,
    columns: &'a [(&'a str, Type)],
    batch: &'a RecordBatch,
    first_row: u64,
}

impl<'a> Batch<'a> {
    pub(super) fn new(
        (path, columns): (&'a Path, &'a [(&'a str, Type)]),
        batch: &'a RecordBatch,
        first_row: u64,
    ) -> Self {
        Self { path, columns, batch, first_row }
    }

    pub(super) fn len(&self) -> usize {
        self.batch.num_rows()
    }

    /// Returns an error about `row` of this batch.
    pub(super) fn wrong(
        &self,
        name: &str,
        row: usize,
        expected: impl Into<String>,
        found: impl Into<String>,
    ) -> Error {
        let place = format!("column {name}, row {}", self.first_row + row as u64);
        Error::new(self.path, place, expected, found)
    }

    pub(super) fn floats(&self, name: &str) -> Result<Vec<f64>, Error> {
        self.no_null(name, FINITE)?;
        let values = self.widened(name)?;
        match values.iter().position(|x| !x.is_finite()) {
            None => Ok(values),
            Some(row) => Err(self.wrong(name, row, FINITE, values[row].to_string())),
        }
    }

    /// Returns finite floats. Null, NaN (which many programs use for null), and columns that were
    /// not read are `None`.
    pub(super) fn optional_floats(&self, name: &str) -> Result<Vec<Option<f64>>, Error> {
        let Some(column) = self.found(name) else { return Ok(vec![None; self.len()]) };
        let values = self.widened(name)?.into_iter().enumerate();
        let checked = values.map(|(row, x)| match column.is_valid(row) && !x.is_nan() {
            false => Ok(None),
            true if x.is_finite() => Ok(Some(x)),
            true => Err(self.wrong(name, row, "a finite number, NaN or null", x.to_string())),
        });
        checked.collect()
    }

    /// Appends vectors to `to`, from one column of finite floats per axis.
    pub(super) fn vectors<const D: usize>(
        &self,
        names: &[String; D],
        to: &mut Vec<[f64; D]>,
    ) -> Result<(), Error> {
        let mut columns: [Vec<f64>; D] = std::array::from_fn(|_| Vec::new());
        for (column, name) in columns.iter_mut().zip(names) {
            *column = self.floats(name)?;
        }
        to.extend((0..self.len()).map(|row| std::array::from_fn(|axis| columns[axis][row])));
        Ok(())
    }

    /// Returns integers below `below` (at most 2^32).
    pub(super) fn integers(&self, name: &str, below: u64) -> Result<Vec<u32>, Error> {
        let values = self.optional_integers(name, below)?.into_iter().enumerate();
        let null = |row| self.wrong(name, row, whole_below(below), "null");
        values.map(|(row, x)| x.ok_or_else(|| null(row))).collect()
    }

    /// Returns integers below `below` (at most 2^32). Null, NaN in float columns, and columns that
    /// were not read are `None`.
    pub(super) fn optional_integers(
        &self,
        name: &str,
        below: u64,
    ) -> Result<Vec<Option<u32>>, Error> {
        let Some(column) = self.found(name) else { return Ok(vec![None; self.len()]) };
        if column.data_type().is_floating() {
            let values = floats(column);
            let whole = (0..self.len()).map(|row| (row, values(row))).map(|(row, x)| {
                match column.is_valid(row) && !x.is_nan() {
                    false => Ok(None),
                    true if x >= 0.0 && x < below as f64 && x.trunc() == x => Ok(Some(x as u32)),
                    true => Err(self.wrong(name, row, whole_below(below), x.to_string())),
                }
            });
            return whole.collect();
        }
        let values = integers(column);
        let checked = (0..self.len()).map(|row| match column.is_valid(row) {
            false => Ok(None),
            true => self.in_range(name, row, values(row), below).map(Some),
        });
        checked.collect()
    }

    pub(super) fn texts(&self, name: &str) -> Vec<Option<&'a str>> {
        let Some(column) = self.found(name) else { return vec![None; self.len()] };
        column.as_string::<i32>().iter().collect()
    }

    /// Appends lists of integers below `below` (at most 2^32) to `to`, and the end of each list to
    /// `offsets`.
    ///
    /// Null is an empty list. Lists longer than `most` are an error before they are copied.
    pub(super) fn integer_lists(
        &self,
        name: &str,
        below: u64,
        most: u64,
        offsets: &mut Vec<u64>,
        to: &mut Vec<u32>,
    ) -> Result<(), Error> {
        let (ranges, values) = self.lists(name)?;
        let values = integers(&values);
        for (row, range) in ranges.into_iter().enumerate() {
            self.at_most(name, row, range.len(), most)?;
            for at in range {
                to.push(self.in_range(name, row, values(at), below)?);
            }
            offsets.push(to.len() as u64);
        }
        Ok(())
    }

    /// Appends lists of finite floats to `to`, and returns the length of each list.
    ///
    /// Null is an empty list. Lists longer than `most` are an error before they are copied.
    pub(super) fn float_lists(
        &self,
        name: &str,
        most: u64,
        to: &mut Vec<f32>,
    ) -> Result<Vec<usize>, Error> {
        let (ranges, values) = self.lists(name)?;
        let values: Values<'_, f64> = match values.data_type().is_floating() {
            true => floats(&values),
            false => {
                let values = integers(&values);
                Box::new(move |at| values(at) as f64)
            }
        };
        let mut lengths = Vec::with_capacity(self.len());
        for (row, range) in ranges.into_iter().enumerate() {
            self.at_most(name, row, range.len(), most)?;
            lengths.push(range.len());
            for x in range.map(&values) {
                if !(x as f32).is_finite() {
                    let expected = "finite numbers in the range of f32";
                    return Err(self.wrong(name, row, expected, x.to_string()));
                }
                to.push(x as f32);
            }
        }
        Ok(lengths)
    }

    pub(super) fn is_null(&self, name: &str) -> bool {
        self.column(name).null_count() == self.len()
    }

    /// Returns floats, or integers that are exact in a double. Values at nulls are undefined.
    fn widened(&self, name: &str) -> Result<Vec<f64>, Error> {
        let column = self.column(name);
        if column.data_type().is_floating() {
            return Ok((0..self.len()).map(floats(column)).collect());
        }
        let values = integers(column);
        let exact = (0..self.len()).map(|row| (row, values(row))).map(|(row, x)| {
            match x as f64 as i128 == x {
                true => Ok(x as f64),
                false => Err(self.wrong(name, row, "a number that is exact in f64", x.to_string())),
            }
        });
        exact.collect()
    }

    fn found(&self, name: &str) -> Option<&'a ArrayRef> {
        let was_read = self.columns.iter().any(|(column, _)| *column == name);
        self.batch.column_by_name(name).filter(|_| was_read)
    }

    fn column(&self, name: &str) -> &'a ArrayRef {
        self.found(name).expect("the table was read with this column")
    }

    fn no_null(&self, name: &str, expected: &str) -> Result<(), Error> {
        let column = self.column(name);
        if column.null_count() == 0 {
            return Ok(());
        }
        let row = (0..column.len()).find(|&row| column.is_null(row));
        Err(self.wrong(name, row.unwrap_or(0), expected, "null"))
    }

    fn in_range(&self, name: &str, row: usize, x: i128, below: u64) -> Result<u32, Error> {
        if x >= 0 && x < i128::from(below) {
            return Ok(x as u32);
        }
        Err(self.wrong(name, row, whole_below(below), x.to_string()))
    }

    fn at_most(&self, name: &str, row: usize, length: usize, most: u64) -> Result<(), Error> {
        if length as u64 <= most {
            return Ok(());
        }
        Err(self.wrong(name, row, format!("at most {most} values"), length.to_string()))
    }

    fn lists(&self, name: &str) -> Result<Lists, Error> {
        let lists = self.column(name).as_list::<i32>();
        let offsets = lists.value_offsets();
        // A null list may have a length.
        let range = |row: usize| match lists.is_valid(row) {
            true => offsets[row] as usize..offsets[row + 1] as usize,
            false => 0..0,
        };
        let ranges: Vec<Range<usize>> = (0..self.len()).map(range).collect();
        let values = lists.values();
        if values.logical_null_count() > 0 {
            let nulls = values.logical_nulls();
            let is_null = |at: usize| nulls.as_ref().is_some_and(|nulls| nulls.is_null(at));
            let holds_null = |row: &usize| ranges[*row].clone().any(is_null);
            if let Some(row) = (0..self.len()).find(holds_null) {
                return Err(self.wrong(name, row, "a list of numbers", "null in the list"));
            }
        }
        Ok((ranges, values.clone()))
    }
}

/// The ranges of lists in their values, and the values.
type Lists = (Vec<Range<usize>>, ArrayRef);

const FINITE: &str = "a finite number";

fn whole_below(below: u64) -> String {
    format!("a whole number below {below}")
}

/// A function from an index to a widened value. Widening all values at once would take 16 times the
/// memory of bytes.
type Values<'a, T> = Box<dyn Fn(usize) -> T + 'a>;

macro_rules! widened {
    ($array:expr, $wide:ident, $null:expr, $($variant:ident => $of:ty),*) => {
        match $array.data_type() {
            $(DataType::$variant => {
                let values = $array.as_primitive::<$of>().values();
                Box::new(move |at| $wide::from(values[at]))
            })*
            DataType::Null => Box::new(|_| $null),
            other => unreachable!("the type {other} was checked"),
        }
    };
}

/// Values at nulls are undefined.
fn integers(array: &ArrayRef) -> Values<'_, i128> {
    widened!(
        array, i128, 0,
        Int8 => Int8Type, Int16 => Int16Type, Int32 => Int32Type, Int64 => Int64Type,
        UInt8 => UInt8Type, UInt16 => UInt16Type, UInt32 => UInt32Type, UInt64 => UInt64Type
    )
}

/// Values at nulls are undefined.
fn floats(array: &ArrayRef) -> Values<'_, f64> {
    widened!(
        array, f64, f64::NAN,
        Float16 => Float16Type, Float32 => Float32Type, Float64 => Float64Type
    )
}
