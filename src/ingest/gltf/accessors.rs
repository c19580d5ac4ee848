//! Accessors: arrays of vectors in the buffers.
//!
//! Opening one proves that every byte it speaks of is there, so that reading cannot fail. One that cannot be
//! opened fails nobody but those who use it. Bytes are read one by one: alignment does not matter, nor do
//! the bounds that an accessor declares.

use super::buffers::Buffers;
use super::document::{Document, label};
use crate::ingest::budget::Budget;
use crate::ingest::error::Fault;
use gltf::json::accessor::sparse::Sparse;
use gltf::json::accessor::{ComponentType, GenericComponentType, IndexComponentType, Type};
use gltf::json::buffer::View;
use gltf::json::validation::{Checked, USize64};
use gltf::json::{Accessor as Row, Index};

/// An array whose every element is inside its buffer.
pub(super) struct Accessor<'a> {
    pub component: ComponentType,
    pub shape: Type,
    layout: Layout,
    pub count: usize,
    pub normalized: bool,
    /// Where the elements are; without, they are zero.
    base: Option<Strided<'a>>,
    sparse: Option<Overrides<'a>>,
}

struct Strided<'a> {
    bytes: &'a [u8],
    stride: usize,
}

/// Elements that replace those of the base. The indices ascend.
struct Overrides<'a> {
    indices: Vec<u32>,
    values: &'a [u8],
}

/// Where the parts of an element are.
#[derive(Clone, Copy)]
struct Layout {
    /// Components of a column; a vector is one column.
    rows: usize,
    component_bytes: usize,
    /// From one element to the next, if they are packed.
    step: usize,
    /// What belongs to an element: without the padding after its last column.
    bytes: usize,
}

impl Layout {
    fn of(component: ComponentType, shape: Type) -> Layout {
        let (rows, columns) = match shape {
            Type::Mat2 => (2, 2),
            Type::Mat3 => (3, 3),
            Type::Mat4 => (4, 4),
            vector => (vector.multiplicity(), 1),
        };
        let component_bytes = component.size();
        let tight = rows * component_bytes;
        // Matrices align their columns to four bytes.
        let column_bytes = if columns == 1 { tight } else { tight.next_multiple_of(4) };
        let step = columns * column_bytes;
        Layout { rows, component_bytes, step, bytes: step - column_bytes + tight }
    }
}

/// A component as it is stored.
fn raw(component: ComponentType, bytes: &[u8]) -> f64 {
    match (component, bytes) {
        (ComponentType::I8, &[a, ..]) => f64::from(a as i8),
        (ComponentType::U8, &[a, ..]) => f64::from(a),
        (ComponentType::I16, &[a, b, ..]) => f64::from(i16::from_le_bytes([a, b])),
        (ComponentType::U16, &[a, b, ..]) => f64::from(u16::from_le_bytes([a, b])),
        (ComponentType::U32, &[a, b, c, d, ..]) => f64::from(u32::from_le_bytes([a, b, c, d])),
        (ComponentType::F32, &[a, b, c, d, ..]) => f64::from(f32::from_le_bytes([a, b, c, d])),
        _ => 0.0,
    }
}

/// What a stored one means if normalised (glTF 2.0, 3.6.2.2).
fn largest(component: ComponentType) -> f64 {
    match component {
        ComponentType::I8 => 127.0,
        ComponentType::U8 => 255.0,
        ComponentType::I16 => 32767.0,
        ComponentType::U16 => 65535.0,
        ComponentType::U32 | ComponentType::F32 => 1.0,
    }
}

/// Every accessor of a document: opened, or what is wrong with it.
pub(super) struct Accessors<'a> {
    rows: Vec<Result<Accessor<'a>, String>>,
}

impl<'a> Accessors<'a> {
    pub(super) fn open(
        document: &Document,
        buffers: &'a Buffers<'a>,
        budget: &mut Budget,
    ) -> Result<Accessors<'a>, Fault> {
        let mut rows = Vec::with_capacity(document.accessors.len());
        for (i, row) in document.accessors.iter().enumerate() {
            let sparse = row.sparse.as_ref().map_or(0, |sparse| sparse.count.0);
            // No index without a byte behind it.
            let sparse = sparse.min(buffers.size());
            budget.take(4 * sparse, || label("accessor", i, row.name.as_deref()))?;
            rows.push(Accessor::open(document, buffers, row));
        }
        Ok(Accessors { rows })
    }

    /// The accessor of a number, else what is wrong with it.
    pub(super) fn get(&self, index: Index<Row>) -> Result<&Accessor<'a>, String> {
        match self.rows.get(index.value()) {
            Some(Ok(accessor)) => Ok(accessor),
            Some(Err(problem)) => Err(format!("accessor {index}: {problem}")),
            None => Err(format!("accessor {index} is not in the file")),
        }
    }
}

impl<'a> Accessor<'a> {
    fn open(
        document: &Document,
        buffers: &'a Buffers<'a>,
        row: &Row,
    ) -> Result<Accessor<'a>, String> {
        let (Checked::Valid(GenericComponentType(component)), Checked::Valid(shape)) =
            (row.component_type, row.type_)
        else {
            return Err("has an unknown type".into());
        };
        let layout = Layout::of(component, shape);
        // Indices are 32 bits wide, so no more elements could be spoken of.
        let count = u32::try_from(row.count.0)
            .ok()
            .filter(|&count| count > 0)
            .ok_or_else(|| format!("has {} elements", row.count.0))? as usize;
        let open = |view| Strided::open(document, buffers, row, view, count, layout);
        let base = row.buffer_view.map(open).transpose()?;
        let open = |sparse| Overrides::open(document, buffers, sparse, count, layout);
        let sparse = row.sparse.as_ref().map(open).transpose()?;
        // Neither floats nor integers of 32 bits can be normalised.
        let is_small = !matches!(component, ComponentType::F32 | ComponentType::U32);
        let normalized = row.normalized && is_small;
        Ok(Accessor { component, shape, layout, count, normalized, base, sparse })
    }

    pub(super) fn is_unsigned(&self) -> bool {
        matches!(self.component, ComponentType::U8 | ComponentType::U16 | ComponentType::U32)
    }

    /// Whether there is data at all; without, every element is zero.
    pub(super) fn has_data(&self) -> bool {
        self.base.is_some() || self.sparse.is_some()
    }

    /// The bytes of an element; none are zeros.
    fn element(&self, i: usize) -> &[u8] {
        let Layout { step, bytes: size, .. } = self.layout;
        if let Some(sparse) = &self.sparse
            && let Ok(at) = sparse.indices.binary_search(&(i as u32))
        {
            return &sparse.values[at * step..][..size];
        }
        self.base.as_ref().map_or(&[], |base| &base.bytes[i * base.stride..][..size])
    }

    /// An element as a vector of `N` components, normalised integers as what they mean. Components that the
    /// accessor does not have are `missing`.
    pub(super) fn vector<const N: usize>(&self, i: usize, missing: f32) -> [f32; N] {
        let (step, rows) = (self.layout.component_bytes, self.layout.rows.min(N));
        let mut vector = [missing; N];
        vector[..rows].fill(0.0);
        for (value, bytes) in vector[..rows].iter_mut().zip(self.element(i).chunks_exact(step)) {
            *value = match (self.component, bytes) {
                (ComponentType::F32, &[a, b, c, d]) => f32::from_le_bytes([a, b, c, d]),
                // The most negative integer means -1 too.
                (component, bytes) if self.normalized => {
                    (raw(component, bytes) / largest(component)).max(-1.0) as f32
                }
                (component, bytes) => raw(component, bytes) as f32,
            };
        }
        vector
    }

    /// An element of floats as a matrix, column by column; zeros if it is none.
    pub(super) fn matrix(&self, i: usize) -> [f32; 16] {
        let mut matrix = [0.0; 16];
        for (value, bytes) in matrix.iter_mut().zip(self.element(i).as_chunks::<4>().0) {
            *value = f32::from_le_bytes(*bytes);
        }
        matrix
    }

    /// An element as a vertex index.
    pub(super) fn index(&self, i: usize) -> u32 {
        match (self.component, self.element(i)) {
            (ComponentType::U32, &[a, b, c, d]) => u32::from_le_bytes([a, b, c, d]),
            (component, element) => raw(component, element) as u32,
        }
    }
}

impl<'a> Strided<'a> {
    fn open(
        document: &Document,
        buffers: &'a Buffers<'a>,
        row: &Row,
        view: Index<View>,
        count: usize,
        layout: Layout,
    ) -> Result<Strided<'a>, String> {
        let bytes = buffers.view(document, view)?;
        let size = layout.bytes;
        let stride = document.buffer_views[view.value()].byte_stride;
        let stride = stride.map_or(layout.step, |stride| stride.0);
        if stride < size {
            return Err(format!("its elements of {size} bytes overlap: stride {stride}"));
        }
        let extent = stride.checked_mul(count - 1).and_then(|bytes| bytes.checked_add(size));
        let start = usize::try_from(row.byte_offset.unwrap_or_default().0).ok();
        let inside = start
            .zip(extent)
            .and_then(|(start, extent)| bytes.get(start..start.checked_add(extent)?));
        let bytes = inside.ok_or_else(|| {
            let room = bytes.len();
            format!("its {count} elements do not fit the {room} bytes of buffer view {view}")
        })?;
        Ok(Strided { bytes, stride })
    }
}

impl<'a> Overrides<'a> {
    fn open(
        document: &Document,
        buffers: &'a Buffers<'a>,
        sparse: &Sparse,
        count: usize,
        layout: Layout,
    ) -> Result<Overrides<'a>, String> {
        let overridden = usize::try_from(sparse.count.0)
            .ok()
            .filter(|&overridden| 0 < overridden && overridden <= count)
            .ok_or("its sparse count is out of range")?;
        let packed = |view: Index<View>, offset: USize64, size: usize| {
            let bytes = buffers.view(document, view)?;
            let start = usize::try_from(offset.0).ok();
            let end = start.zip(overridden.checked_mul(size)).and_then(|(a, b)| a.checked_add(b));
            let inside = start.zip(end).and_then(|(start, end)| bytes.get(start..end));
            inside.ok_or_else(|| "its sparse data does not fit its buffer view".to_string())
        };
        let Checked::Valid(IndexComponentType(kind)) = sparse.indices.component_type else {
            return Err("its sparse indices have a type that indices cannot have".into());
        };
        let coded = packed(sparse.indices.buffer_view, sparse.indices.byte_offset, kind.size())?;
        let indices: Vec<u32> =
            coded.chunks_exact(kind.size()).map(|bytes| raw(kind, bytes) as u32).collect();
        if !indices.is_sorted_by(|a, b| a < b)
            || indices.last().is_some_and(|&i| i as usize >= count)
        {
            return Err("its sparse indices do not ascend or are out of range".into());
        }
        let values = sparse.values.byte_offset;
        let values = packed(sparse.values.buffer_view, values, layout.step)?;
        Ok(Overrides { indices, values })
    }
}
