//! Columns while a reader fills them, and what a writer must leave out.

use crate::{ReadError, WriteError};
use octofold::{Attributes, Finding, Run, Soup, SoupBuilder};

/// Colour of points and faces that a file gives none, where it gives others one.
pub(crate) const NO_COLOUR: [u8; 4] = [255; 4];

/// Puts `value` at place `at` of a column that exists from its first value on; places between are
/// filled with `blank`.
pub(crate) fn put<T: Clone>(column: &mut Option<Vec<T>>, at: usize, blank: T, value: T) {
    let column = column.get_or_insert_default();
    column.resize(at, blank);
    column.push(value);
}

/// Fills all columns up to the number of points, corners and faces, and checks everything.
pub(crate) fn finish(mut builder: SoupBuilder, format: &'static str) -> Result<Soup, ReadError> {
    let (points, corners, faces) = (builder.points.len(), builder.corners.len(), builder.faces());
    let a = &mut builder.attributes;
    pad(&mut a.point_colours, points, NO_COLOUR);
    pad(&mut a.point_normals, points, [0.0; 3]);
    pad(&mut a.corner_uvs, corners, [0.0; 2]);
    pad(&mut a.corner_normals, corners, [0.0; 3]);
    pad(&mut a.face_colours, faces, NO_COLOUR);
    pad(&mut a.face_materials, faces, Attributes::NO_MATERIAL);
    pad(&mut a.face_labels, faces, 0);
    builder.build().map_err(|source| ReadError::Shape { format, source })
}

fn pad<T: Clone>(column: &mut Option<Vec<T>>, len: usize, blank: T) {
    if let Some(column) = column {
        column.resize(len, blank);
    }
}

/// The columns of a shape, for saying which ones a format cannot hold.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Column {
    PointColours,
    PointNormals,
    CornerUvs,
    CornerNormals,
    FaceLabels,
}

/// Tells of columns that are there and that the format drops.
pub(crate) fn tell_dropped(soup: &Soup, format: &'static str, dropped: &[Column], run: &Run) {
    let a = soup.attributes();
    let names: Vec<_> = dropped
        .iter()
        .filter_map(|column| match column {
            Column::PointColours => a.point_colours.is_some().then_some("point colours"),
            Column::PointNormals => a.point_normals.is_some().then_some("point normals"),
            Column::CornerUvs => a.corner_uvs.is_some().then_some("texture coordinates"),
            Column::CornerNormals => a.corner_normals.is_some().then_some("corner normals"),
            Column::FaceLabels => a.face_labels.is_some().then_some("labels"),
        })
        .collect();
    if !names.is_empty() {
        let text = format!("{format} cannot hold {}; they are left out", names.join(", "));
        run.finding(Finding::warning("dropped-columns", text).of(names.len() as u64));
    }
}

/// The points in `f32`, with a finding where that rounds.
pub(crate) fn single(
    points: &[[f64; 3]],
    format: &'static str,
    run: &Run,
) -> Result<Vec<[f32; 3]>, WriteError> {
    let singles: Vec<_> = points.iter().map(|p| p.map(|x| x as f32)).collect();
    if let Some(at) = singles.iter().position(|p| p.iter().any(|x| !x.is_finite())) {
        let fact = format!("point {at} is too far out for 32-bit coordinates; scale the shape");
        return Err(WriteError::Unfit { format, fact });
    }
    let exact = |(p, s): (&[f64; 3], &[f32; 3])| (0..3).all(|i| p[i] == f64::from(s[i]));
    let rounded = points.iter().zip(&singles).filter(|&pair| !exact(pair)).count();
    if rounded > 0 {
        let text = format!("{rounded} points are rounded to the 32-bit coordinates of {format}");
        run.finding(Finding::note("rounded-to-f32", text).of(rounded as u64));
    }
    Ok(singles)
}

/// An error of the writer underneath a sink.
pub(crate) fn sink_error(source: std::io::Error) -> WriteError {
    WriteError::Io { path: "output".into(), source }
}
