//! Accessors: arrays of vectors in the buffers.
//!
//! Opening one proves that every byte it speaks of is there, so reading cannot fail.

use super::buffers::Buffers;
use super::document::{self, Document, label};
use crate::ingest::error::Fault;

/// More elements than this do not exist without bytes behind them, in all sparse accessors of a
/// file together.
const MOST_UNBACKED: usize = 1 << 26;

/// An array whose every element is inside its buffer.
pub(super) struct Accessor<'a> {
    pub component: Component,
    pub shape: Shape,
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

/// The type of a component.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

/// Rows and columns of an element; a vector is one column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Shape {
    pub rows: usize,
    pub columns: usize,
}

impl Component {
    fn parse(code: u32) -> Option<Component> {
        Some(match code {
            5120 => Component::I8,
            5121 => Component::U8,
            5122 => Component::I16,
            5123 => Component::U16,
            5125 => Component::U32,
            5126 => Component::F32,
            _ => return None,
        })
    }

    fn size(self) -> usize {
        match self {
            Component::I8 | Component::U8 => 1,
            Component::I16 | Component::U16 => 2,
            Component::U32 | Component::F32 => 4,
        }
    }

    pub(super) fn is_unsigned(self) -> bool {
        matches!(self, Component::U8 | Component::U16 | Component::U32)
    }

    /// The value as it is stored.
    fn raw(self, bytes: &[u8]) -> f64 {
        match (self, bytes) {
            (Component::I8, &[a, ..]) => f64::from(a as i8),
            (Component::U8, &[a, ..]) => f64::from(a),
            (Component::I16, &[a, b, ..]) => f64::from(i16::from_le_bytes([a, b])),
            (Component::U16, &[a, b, ..]) => f64::from(u16::from_le_bytes([a, b])),
            (Component::U32, &[a, b, c, d, ..]) => f64::from(u32::from_le_bytes([a, b, c, d])),
            (Component::F32, &[a, b, c, d, ..]) => f64::from(f32::from_le_bytes([a, b, c, d])),
            _ => 0.0,
        }
    }

    /// What a stored one means if normalised (glTF 2.0, 3.6.2.2).
    fn largest(self) -> f64 {
        match self {
            Component::I8 => 127.0,
            Component::U8 => 255.0,
            Component::I16 => 32767.0,
            Component::U16 => 65535.0,
            Component::U32 | Component::F32 => 1.0,
        }
    }
}

impl Shape {
    pub(super) const SCALAR: Shape = Shape { rows: 1, columns: 1 };
    pub(super) const VEC2: Shape = Shape { rows: 2, columns: 1 };
    pub(super) const VEC3: Shape = Shape { rows: 3, columns: 1 };
    pub(super) const VEC4: Shape = Shape { rows: 4, columns: 1 };

    fn parse(name: &str) -> Option<Shape> {
        Some(match name {
            "SCALAR" => Shape::SCALAR,
            "VEC2" => Shape::VEC2,
            "VEC3" => Shape::VEC3,
            "VEC4" => Shape::VEC4,
            "MAT2" => Shape { rows: 2, columns: 2 },
            "MAT3" => Shape { rows: 3, columns: 3 },
            "MAT4" => Shape { rows: 4, columns: 4 },
            _ => return None,
        })
    }

    pub(super) fn components(self) -> usize {
        self.rows * self.columns
    }

    /// Bytes from one column to the next: matrices align theirs to four bytes.
    fn column_bytes(self, component: Component) -> usize {
        let tight = self.rows * component.size();
        if self.columns == 1 { tight } else { tight.next_multiple_of(4) }
    }

    /// Bytes from one element to the next, if they are packed.
    fn step(self, component: Component) -> usize {
        self.columns * self.column_bytes(component)
    }

    /// Bytes that belong to an element: without the padding after its last column.
    fn bytes(self, component: Component) -> usize {
        (self.columns - 1) * self.column_bytes(component) + self.rows * component.size()
    }
}

impl<'a> Accessor<'a> {
    /// Opens every accessor of the document.
    pub(super) fn open_all(
        document: &Document,
        buffers: &'a Buffers<'a>,
    ) -> Result<Vec<Accessor<'a>>, Fault> {
        let mut unbacked = 0usize;
        let open = |(i, row): (usize, &document::Accessor)| {
            let object = label("accessor", i, row.name.as_deref());
            let accessor = Accessor::open(document, buffers, row, &object)?;
            if accessor.base.is_none() && accessor.sparse.is_some() {
                unbacked = unbacked.saturating_add(accessor.count);
            }
            match unbacked <= MOST_UNBACKED {
                true => Ok(accessor),
                false => Err(Fault::new(object, "speaks of too many elements without data")),
            }
        };
        document.accessors.iter().enumerate().map(open).collect()
    }

    fn open(
        document: &Document,
        buffers: &'a Buffers<'a>,
        row: &document::Accessor,
        object: &str,
    ) -> Result<Accessor<'a>, Fault> {
        let fault = |problem: String| Fault::new(object, problem);
        let component = Component::parse(row.component_type)
            .ok_or_else(|| fault(format!("has unknown component type {}", row.component_type)))?;
        let shape = Shape::parse(&row.shape)
            .ok_or_else(|| fault(format!("has unknown type {:?}", row.shape)))?;
        if row.normalized && matches!(component, Component::F32 | Component::U32) {
            return Err(fault("is normalised, which its component type cannot be".into()));
        }
        // Indices are 32 bits wide, so no more elements could be spoken of.
        let count = u32::try_from(row.count)
            .ok()
            .filter(|&count| count > 0)
            .ok_or_else(|| fault(format!("has {} elements", row.count)))?
            as usize;
        let base = match row.buffer_view {
            Some(view) => Some(Strided::open(
                document,
                buffers,
                row,
                view,
                count,
                (component, shape),
                object,
            )?),
            None if row.byte_offset.is_some() => {
                return Err(fault("has an offset into no buffer view".into()));
            }
            None => None,
        };
        let sparse = row
            .sparse
            .as_ref()
            .map(|sparse| {
                Overrides::open(document, buffers, sparse, count, (component, shape), object)
            })
            .transpose()?;
        Ok(Accessor { component, shape, count, normalized: row.normalized, base, sparse })
    }

    /// Whether there is data at all; without, every element is zero.
    pub(super) fn has_data(&self) -> bool {
        self.base.is_some() || self.sparse.is_some()
    }

    /// Whether the elements are interleaved with others, as only vertex attributes may be.
    pub(super) fn is_interleaved(&self) -> bool {
        let tight = self.shape.step(self.component);
        self.base.as_ref().is_some_and(|base| base.stride != tight)
    }

    /// The bytes of an element; none are zeros.
    fn element(&self, i: usize) -> &[u8] {
        let size = self.shape.bytes(self.component);
        if let Some(sparse) = &self.sparse
            && let Ok(at) = sparse.indices.binary_search(&(i as u32))
        {
            return &sparse.values[at * self.shape.step(self.component)..][..size];
        }
        self.base.as_ref().map_or(&[], |base| &base.bytes[i * base.stride..][..size])
    }

    /// Calls back with every component of every element as it is stored, and its number.
    pub(super) fn for_each_raw(&self, mut visit: impl FnMut(usize, f64)) {
        let (step, column) = (self.component.size(), self.shape.column_bytes(self.component));
        let offsets: Vec<usize> = (0..self.shape.components())
            .map(|i| i / self.shape.rows * column + i % self.shape.rows * step)
            .collect();
        for element in (0..self.count).map(|i| self.element(i)) {
            for (i, &offset) in offsets.iter().enumerate() {
                visit(i, self.component.raw(element.get(offset..).unwrap_or(&[])));
            }
        }
    }

    /// All elements as vectors of `N` components, normalised integers as what they mean.
    /// Components that the accessor does not have are `missing`.
    pub(super) fn vectors<const N: usize>(&self, missing: f32) -> Vec<[f32; N]> {
        (0..self.count).map(|i| self.vector(i, missing)).collect()
    }

    /// One element of [`vectors`](Self::vectors).
    pub(super) fn vector<const N: usize>(&self, i: usize, missing: f32) -> [f32; N] {
        let (step, rows) = (self.component.size(), self.shape.rows.min(N));
        let mut vector = [missing; N];
        vector[..rows].fill(0.0);
        for (value, bytes) in vector[..rows].iter_mut().zip(self.element(i).chunks_exact(step)) {
            *value = match (self.component, bytes) {
                (Component::F32, &[a, b, c, d]) => f32::from_le_bytes([a, b, c, d]),
                // The most negative integer means -1 too.
                (component, bytes) if self.normalized => {
                    (component.raw(bytes) / component.largest()).max(-1.0) as f32
                }
                (component, bytes) => component.raw(bytes) as f32,
            };
        }
        vector
    }

    /// An element as a vertex index.
    pub(super) fn index(&self, i: usize) -> u32 {
        match (self.component, self.element(i)) {
            (Component::U32, &[a, b, c, d]) => u32::from_le_bytes([a, b, c, d]),
            (component, element) => component.raw(element) as u32,
        }
    }
}

impl<'a> Strided<'a> {
    fn open(
        document: &Document,
        buffers: &'a Buffers<'a>,
        row: &document::Accessor,
        view: u32,
        count: usize,
        (component, shape): (Component, Shape),
        object: &str,
    ) -> Result<Strided<'a>, Fault> {
        let fault = |problem: String| Fault::new(object, problem);
        let bytes = buffers.view(document, view, object)?;
        let view_row = &document.buffer_views[view as usize];
        let size = shape.bytes(component);
        let stride = match view_row.byte_stride {
            Some(stride) => usize::try_from(stride).unwrap_or(usize::MAX),
            None => shape.step(component),
        };
        if stride < size {
            return Err(fault(format!("its elements of {size} bytes overlap: stride {stride}")));
        }
        let offset = row.byte_offset.unwrap_or(0);
        let alignment = component.size() as u64;
        let aligned = offset.is_multiple_of(alignment)
            && offset.wrapping_add(view_row.byte_offset).is_multiple_of(alignment)
            && (stride as u64).is_multiple_of(alignment)
            && (shape.columns == 1 || offset.is_multiple_of(4));
        if !aligned {
            return Err(fault("is not aligned to its component type".into()));
        }
        let extent = stride.checked_mul(count - 1).and_then(|bytes| bytes.checked_add(size));
        let start = usize::try_from(offset).ok();
        let inside = start
            .zip(extent)
            .and_then(|(start, extent)| bytes.get(start..start.checked_add(extent)?));
        let bytes = inside.ok_or_else(|| {
            let room = view_row.byte_length;
            fault(format!("its {count} elements do not fit the {room} bytes of buffer view {view}"))
        })?;
        Ok(Strided { bytes, stride })
    }
}

impl<'a> Overrides<'a> {
    fn open(
        document: &Document,
        buffers: &'a Buffers<'a>,
        sparse: &document::Sparse,
        count: usize,
        (component, shape): (Component, Shape),
        object: &str,
    ) -> Result<Overrides<'a>, Fault> {
        let fault = |problem: &str| Fault::new(object, format!("its sparse {problem}"));
        let overridden = usize::try_from(sparse.count)
            .ok()
            .filter(|&overridden| 0 < overridden && overridden <= count)
            .ok_or_else(|| fault("count is out of range"))?;
        let packed = |view: u32, offset: u64, size: usize| {
            let bytes = buffers.view(document, view, object)?;
            if document.buffer_views[view as usize].byte_stride.is_some() {
                return Err(fault("data has a stride"));
            }
            let start = usize::try_from(offset).ok();
            let end = start.zip(overridden.checked_mul(size)).and_then(|(a, b)| a.checked_add(b));
            let inside = start.zip(end).and_then(|(start, end)| bytes.get(start..end));
            inside.ok_or_else(|| fault("data does not fit its buffer view"))
        };
        let kind = Component::parse(sparse.indices.component_type)
            .filter(|kind| kind.is_unsigned())
            .ok_or_else(|| fault("indices have a component type that indices cannot have"))?;
        let coded = packed(sparse.indices.buffer_view, sparse.indices.byte_offset, kind.size())?;
        let indices: Vec<u32> =
            coded.chunks_exact(kind.size()).map(|bytes| kind.raw(bytes) as u32).collect();
        if !indices.is_sorted_by(|a, b| a < b)
            || indices.last().is_some_and(|&i| i as usize >= count)
        {
            return Err(fault("indices do not ascend or are out of range"));
        }
        let size = shape.step(component);
        let values = packed(sparse.values.buffer_view, sparse.values.byte_offset, size)?;
        Ok(Overrides { indices, values })
    }
}
