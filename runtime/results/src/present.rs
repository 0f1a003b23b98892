//! Presentation, independent of what is presented: numbers as people read them, tables, markup, axes and charts.

pub(crate) mod axis;
pub(crate) mod chart;
pub(crate) mod markup;
pub(crate) mod names;
pub(crate) mod number;
pub(crate) mod table;
