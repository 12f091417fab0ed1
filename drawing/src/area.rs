//! Areas of the plane, cell by cell: where a robot can work.

use std::fmt::Write as _;

use crate::layout::Layout;
use crate::paint::Picture;

/// How an area is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Look {
    /// Filled.
    Filled,
    /// Filled, paler.
    Pale,
    /// Its border.
    Outlined,
    /// Its border in dashes.
    Dashed,
}

impl Look {
    fn class(self) -> &'static str {
        match self {
            Self::Filled => "robot-area-filled",
            Self::Pale => "robot-area-pale",
            Self::Outlined => "robot-area-outlined",
            Self::Dashed => "robot-area-dashed",
        }
    }
}

/// Part of a rectangle of equal cells.
#[derive(Clone, Copy, Debug)]
pub struct Area<'a> {
    /// Lower left and upper right corner of the rectangle (m).
    pub corners: [[f64; 2]; 2],
    /// Cells in a row.
    pub columns: usize,
    /// Which cells belong to the area, row by row from the lower left.
    pub cells: &'a [bool],
    /// How it is drawn.
    pub look: Look,
    /// What it is, in numbers and letters.
    pub name: &'a str,
}

impl Area<'_> {
    pub(crate) fn paint(&self, picture: &mut Picture, layout: &Layout) {
        assert!(self.columns > 0 && self.cells.len().is_multiple_of(self.columns), "cells make whole rows");
        let path = match self.look {
            Look::Filled | Look::Pale => self.filling(layout),
            Look::Outlined | Look::Dashed => self.border(layout),
        };
        picture.path(self.look.class(), &path);
    }

    pub(crate) fn name(&self, picture: &mut Picture, layout: &Layout, line: usize) {
        let [x, y] = layout.legend(line);
        picture.path(self.look.class(), &format!("M{:.1} {:.1}h20v-12h-20z", x - 28.0, y + 1.0));
        picture.text("robot-note", [x, y], "start", self.name);
    }

    fn rows(&self) -> usize {
        self.cells.len() / self.columns
    }

    /// Whether the cell belongs to the area; beyond the rectangle none does. Counted from 1.
    fn has(&self, column: usize, row: usize) -> bool {
        let inside = (1..=self.columns).contains(&column) && (1..=self.rows()).contains(&row);
        inside && self.cells[(row - 1) * self.columns + column - 1]
    }

    /// The corner of cells, in drawing units.
    fn corner(&self, layout: &Layout, column: usize, row: usize) -> [f64; 2] {
        let [low, high] = self.corners;
        let share = [column as f64 / self.columns as f64, row as f64 / self.rows() as f64];
        layout.place([0, 1].map(|k| low[k] + share[k] * (high[k] - low[k])))
    }

    /// Cells side by side as one rectangle.
    fn filling(&self, layout: &Layout) -> String {
        let mut path = String::new();
        for row in 1..=self.rows() {
            for (from, to) in runs(self.columns, |column| self.has(column, row)) {
                let ([left, bottom], [right, top]) = (self.corner(layout, from, row - 1), self.corner(layout, to, row));
                let _ = write!(path, "M{left:.1} {bottom:.1}H{right:.1}V{top:.1}H{left:.1}z");
            }
        }
        path
    }

    /// Lines between cells that belong to the area and cells that do not.
    fn border(&self, layout: &Layout) -> String {
        let mut path = String::new();
        let mut line = |from: [f64; 2], to: [f64; 2]| {
            let _ = write!(path, "M{:.1} {:.1}L{:.1} {:.1}", from[0], from[1], to[0], to[1]);
        };
        for row in 0..=self.rows() {
            for (from, to) in runs(self.columns, |column| self.has(column, row) != self.has(column, row + 1)) {
                line(self.corner(layout, from, row), self.corner(layout, to, row));
            }
        }
        for column in 0..=self.columns {
            for (from, to) in runs(self.rows(), |row| self.has(column, row) != self.has(column + 1, row)) {
                line(self.corner(layout, column, from), self.corner(layout, column, to));
            }
        }
        path
    }
}

/// Where `holds` from one cell to another without a gap, of cells `1..=count`: before its first cell, behind its last.
fn runs(count: usize, holds: impl Fn(usize) -> bool) -> Vec<(usize, usize)> {
    let mut runs: Vec<(usize, usize)> = Vec::new();
    for cell in (1..=count).filter(|cell| holds(*cell)) {
        match runs.last_mut() {
            Some((_, end)) if *end == cell - 1 => *end = cell,
            _ => runs.push((cell - 1, cell)),
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Robot;

    #[test]
    fn cells_in_a_row_are_one_piece_and_a_border_goes_all_round() {
        let ends = [[0.0, 0.0], [3.0, 2.0]];
        let robot = Robot { anchors: &ends, attachments: &[[0.0; 2]; 2], pose: [0.0; 3] };
        let cells = [true, true, false, false, true, true];
        let area = Area { corners: ends, columns: 3, cells: &cells, look: Look::Filled, name: "" };
        let layout = Layout::new(&robot, &[area]);
        assert_eq!(area.filling(&layout).matches('z').count(), 2);
        // Two steps of a stair: three lines across, of which the middle one has two parts, and four upright.
        assert_eq!(area.border(&layout).matches('M').count(), 8);
        assert_eq!(runs(5, |cell| cell != 3), [(0, 2), (3, 5)]);
    }
}
