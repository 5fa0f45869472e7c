//! unlift: report.
