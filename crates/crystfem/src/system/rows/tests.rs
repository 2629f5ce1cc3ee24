//! Tests of rows, their products and their storage.

use super::*;

/// Product of −1, 2.5, −1 on a line of 10 000 with one different row agrees with the plain sum.
#[test]
fn a_line_has_few_stencils_and_the_right_product() {
    let size = 10_000;
    let values = |row: usize| if row == 5000 { [-2.0, 7.0, -3.0] } else { [-1.0, 2.5, -1.0] };
    let mut rows = ConductionRows::build(size, true, |row, out| {
        out.begin(std::iter::empty());
        let v = values(row);
        for (k, offset) in [-1_i32, 0, 1].into_iter().enumerate() {
            if (0..size as i64).contains(&(row as i64 + i64::from(offset))) {
                out.add(offset, v[k], 0.5 * v[k]);
            }
        }
        out.own = row == 77;
    });
    assert_eq!(rows.stored()[0], 5);
    rows.add(77, 78, 10.0, 20.0);
    rows.add(78, 79, 1e9, 1e9);
    let x: Vec<f64> = (0..size).map(|k| ((k * k) as f64).sin()).collect();
    let d: Vec<f64> = (0..size).map(|k| 1.0 + (k as f64).cos()).collect();
    let mut y = vec![0.0; size];
    let dot = rows.product(Some(&d), [2.0, 3.0], &x, &mut y);
    let mut exact_dot = 0.0;
    for row in 0..size {
        let v = values(row);
        let mut sum = d[row] * x[row];
        for k in 0..3 {
            if let Some(other) = (row + k).checked_sub(1).filter(|&other| other < size) {
                sum += 4.0 * v[k] * x[other];
            }
        }
        if row == 77 {
            sum += 70.0 * x[78];
        }
        exact_dot += x[row] * sum;
        // three products of order 10
        assert!((y[row] - sum).abs() < 1e-13, "{row}");
    }
    assert!((dot - exact_dot).abs() < 1e-9);
    assert_eq!(rows.row(77, [0.0, 1.0]).collect::<Vec<_>>(), [(76, -1.0), (77, 2.5), (78, 9.0)]);
    let mut diagonal = vec![1.0; size];
    rows.add_diagonal([2.0, 3.0], &mut diagonal);
    assert_eq!([diagonal[4999], diagonal[5000]], [1.0 + 3.0 * 2.5 + 2.0 * 1.25, 1.0 + 3.0 * 7.0 + 2.0 * 3.5]);
    assert_eq!(rows.largest(|row, value| if row < 100 { row as f64 } else { value }), 99.0);
}

/// Rows of a grid 40 wide that alternate between seven lists of values share them: products by vectors of
/// four, up to the last row, whose columns end with the array; births change values repeatedly, and unused
/// lists are dropped.
#[test]
fn rows_that_alternate_share_their_values() {
    let (width, size) = (40_i64, 2 * CHUNK + 100);
    let kind = |row: usize, turn: usize| (row * row + turn * 1000) % 7 + 7 * turn;
    let entries = |row: usize, turn: usize| {
        let own = 1.0 + 0.1 * kind(row, turn) as f64;
        let around = (-1..=1).flat_map(move |j| (-1..=1).map(move |i| j * width + i));
        let inside = around.filter(move |offset| (0..size as i64).contains(&(row as i64 + offset)));
        inside.map(move |offset| {
            (offset as i32, if offset == 0 { 8.0 * own } else { -own - 1e-3 * offset as f64 })
        })
    };
    let fill = |turn: usize| {
        move |row: usize, out: &mut RowBuilder| {
            out.begin([row as u32, turn as u32].into_iter());
            entries(row, turn).for_each(|(offset, value)| out.add(offset, value, 0.0));
        }
    };
    let mut rows = ConductionRows::build(size, false, fill(0));
    assert!(rows.are_few() && (0..rows.items()).all(|item| rows.is_unequal(item)));
    let all: Vec<u32> = (0..size as u32).collect();
    for turn in 1..40 {
        rows.update(size, &all, fill(turn));
        // seven lists, fewer at the ends; at most a quarter unused, or one a row
        assert!(
            rows.stencils.values.count() * 9 <= size + 400 * 9,
            "{turn}: {}",
            rows.stencils.values.count()
        );
    }
    let x: Vec<f64> = (0..size).map(|k| (0.3 * k as f64).sin()).collect();
    let [mut y, mut flow] = [vec![0.0; size], vec![0.0; size]];
    rows.product(None, [0.0, 2.0], &x, &mut y);
    rows.flow(&x, &mut flow);
    for row in 0..size {
        let other = |offset: i32| x[row.wrapping_add_signed(offset as isize)];
        let exact: f64 = entries(row, 39).map(|(offset, value)| 2.0 * value * other(offset)).sum();
        let exact_flow: f64 = entries(row, 39).map(|(offset, value)| value * (other(offset) - x[row])).sum();
        // nine products of order 1000
        assert!((y[row] - exact).abs() < 1e-11 && (flow[row] - exact_flow).abs() < 1e-11, "{row}");
    }
}
