//! Columns as third parties write them, to the one type that is used here.

use crate::Error;
use arrow_array::cast::AsArray;
use arrow_array::types::{
    Float16Type, Float32Type, Float64Type, Int8Type, Int16Type, Int32Type, Int64Type, UInt8Type,
    UInt16Type, UInt32Type, UInt64Type,
};
use arrow_array::{Array, ArrayRef, RecordBatch};
use arrow_schema::DataType;
use std::fmt;
use std::path::Path;

/// What a column must hold; its width does not matter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Type {
    /// Half, single or double floats.
    Float,
    /// Signed or unsigned integers.
    Integer,
    /// Text.
    Text,
    /// Lists of floats.
    Floats,
    /// Lists of integers.
    Integers,
    /// Lists of either.
    Numbers,
}

impl Type {
    pub(super) fn admits(self, found: &DataType) -> bool {
        let float = DataType::is_floating;
        match (self, found) {
            (Self::Float, found) => float(found),
            (Self::Integer, found) => found.is_integer(),
            (Self::Text, found) => *found == DataType::Utf8,
            (Self::Floats, DataType::List(of)) => float(of.data_type()),
            (Self::Integers, DataType::List(of)) => of.data_type().is_integer(),
            (Self::Numbers, DataType::List(of)) => {
                float(of.data_type()) || of.data_type().is_integer()
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

/// The names of the coordinates of a vector column: `foot_x`, `foot_y`, ... for `foot_`.
pub(super) fn coordinate_names<const D: usize>(prefix: &str) -> [String; D] {
    std::array::from_fn(|axis| format!("{prefix}{}", ["x", "y", "z"][axis]))
}

/// Some rows of a table. Columns are asked for by name, after [`super::table::Table::read`] has
/// checked that they are there and of the right type.
#[derive(Debug)]
pub(super) struct Batch<'a> {
    path: &'a Path,
    batch: &'a RecordBatch,
    first_row: u64,
}

impl<'a> Batch<'a> {
    pub(super) fn new(path: &'a Path, batch: &'a RecordBatch, first_row: u64) -> Self {
        Self { path, batch, first_row }
    }

    /// Number of rows here.
    pub(super) fn len(&self) -> usize {
        self.batch.num_rows()
    }

    /// The error about `row` (of this batch) of the column `name`.
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

    /// Finite floats.
    pub(super) fn floats(&self, name: &str) -> Result<Vec<f64>, Error> {
        self.no_null(name, FINITE)?;
        let values = floats(self.column(name));
        match values.iter().position(|x| !x.is_finite()) {
            None => Ok(values),
            Some(row) => Err(self.wrong(name, row, FINITE, values[row].to_string())),
        }
    }

    /// Finite floats or null.
    pub(super) fn optional_floats(&self, name: &str) -> Result<Vec<Option<f64>>, Error> {
        let column = self.column(name);
        let values = floats(column).into_iter().enumerate();
        let checked = values.map(|(row, x)| match column.is_valid(row) {
            false => Ok(None),
            true if x.is_finite() => Ok(Some(x)),
            true => Err(self.wrong(name, row, "a finite number or null", x.to_string())),
        });
        checked.collect()
    }

    /// Vectors from one column of finite floats per axis, appended to `to`.
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

    /// Integers from 0 to below `below` (at most 2^32).
    pub(super) fn integers(&self, name: &str, below: u64) -> Result<Vec<u32>, Error> {
        self.no_null(name, &whole_below(below))?;
        let values = integers(self.column(name)).into_iter().enumerate();
        let checked = values.map(|(row, x)| self.in_range(name, row, x, below));
        checked.collect()
    }

    /// Integers from 0 to below `below` (at most 2^32), or null.
    pub(super) fn optional_integers(
        &self,
        name: &str,
        below: u64,
    ) -> Result<Vec<Option<u32>>, Error> {
        let column = self.column(name);
        let values = integers(column).into_iter().enumerate();
        let checked = values.map(|(row, x)| match column.is_valid(row) {
            false => Ok(None),
            true => self.in_range(name, row, x, below).map(Some),
        });
        checked.collect()
    }

    /// Texts or null.
    pub(super) fn texts(&self, name: &str) -> Vec<Option<&'a str>> {
        self.column(name).as_string::<i32>().iter().collect()
    }

    /// Lists of integers from 0 to below `below` (at most 2^32): values appended to `to`, the end of
    /// each list to `offsets`. Lists longer than `most` are refused before they are copied.
    pub(super) fn integer_lists(
        &self,
        name: &str,
        below: u64,
        most: u64,
        offsets: &mut Vec<u64>,
        to: &mut Vec<u32>,
    ) -> Result<(), Error> {
        let lists = self.lists(name)?;
        let values = integers(&lists.values);
        for row in 0..self.len() {
            let list = &values[lists.ends[row]..lists.ends[row + 1]];
            if list.len() as u64 > most {
                let expected = format!("at most {most} values");
                return Err(self.wrong(name, row, expected, list.len().to_string()));
            }
            for &x in list {
                to.push(self.in_range(name, row, x, below)?);
            }
            offsets.push(to.len() as u64);
        }
        Ok(())
    }

    /// Lists of finite floats: values appended to `to`, and returned the length of each list.
    pub(super) fn float_lists(&self, name: &str, to: &mut Vec<f32>) -> Result<Vec<usize>, Error> {
        let lists = self.lists(name)?;
        let values = floats(&lists.values);
        let mut lengths = Vec::with_capacity(self.len());
        for row in 0..self.len() {
            let list = &values[lists.ends[row]..lists.ends[row + 1]];
            for &x in list {
                if !(x as f32).is_finite() {
                    let expected = "finite numbers in the range of f32";
                    return Err(self.wrong(name, row, expected, x.to_string()));
                }
                to.push(x as f32);
            }
            lengths.push(list.len());
        }
        Ok(lengths)
    }

    fn column(&self, name: &str) -> &'a ArrayRef {
        let column = self.batch.column_by_name(name);
        column.expect("the table was read with this column")
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

    fn lists(&self, name: &str) -> Result<Lists, Error> {
        self.no_null(name, "a list")?;
        let lists = self.column(name).as_list::<i32>();
        let ends: Vec<usize> = lists.value_offsets().iter().map(|&at| at as usize).collect();
        let values = lists.values();
        if values.null_count() > 0 {
            let holds_null =
                |row: &usize| (ends[*row]..ends[*row + 1]).any(|at| values.is_null(at));
            if let Some(row) = (0..self.len()).find(holds_null) {
                return Err(self.wrong(name, row, "a list of numbers", "null in the list"));
            }
        }
        let values = values.clone();
        Ok(Lists { ends, values })
    }
}

/// Where lists end (`ends[row]..ends[row + 1]`) in their values.
struct Lists {
    ends: Vec<usize>,
    values: ArrayRef,
}

const FINITE: &str = "a finite number";

fn whole_below(below: u64) -> String {
    format!("a whole number below {below}")
}

/// The values of an array of integers; what stands at nulls has no meaning.
fn integers(array: &ArrayRef) -> Vec<i128> {
    macro_rules! widened {
        ($($variant:ident => $of:ty),*) => {
            match array.data_type() {
                $(DataType::$variant => {
                    let values = array.as_primitive::<$of>().values();
                    values.iter().map(|&x| i128::from(x)).collect()
                })*
                other => unreachable!("{other} was checked to be integers"),
            }
        };
    }
    widened!(
        Int8 => Int8Type, Int16 => Int16Type, Int32 => Int32Type, Int64 => Int64Type,
        UInt8 => UInt8Type, UInt16 => UInt16Type, UInt32 => UInt32Type, UInt64 => UInt64Type
    )
}

/// The values of an array of floats; what stands at nulls has no meaning.
fn floats(array: &ArrayRef) -> Vec<f64> {
    macro_rules! widened {
        ($($variant:ident => $of:ty),*) => {
            match array.data_type() {
                $(DataType::$variant => {
                    let values = array.as_primitive::<$of>().values();
                    values.iter().map(|&x| f64::from(x)).collect()
                })*
                other => unreachable!("{other} was checked to be floats"),
            }
        };
    }
    widened!(Float16 => Float16Type, Float32 => Float32Type, Float64 => Float64Type)
}
