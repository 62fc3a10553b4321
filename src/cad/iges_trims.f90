!> Trimmed surfaces of an IGES file (144): a rational B-spline surface (128) with loops. Each is a
!! curve on a surface (142) whose curve in the parameter plane is a rational B-spline curve (126),
!! line (110), circular arc (100) or composite curve (102) of these.
module iges_trims
  use kinds, only: wp
  use failure, only: error_t
  use text, only: to_text, counted, place_text
  use nurbs_curve, only: nurbs_curve_t
  use nurbs_surface, only: nurbs_surface_t
  use trim_curve, only: trim_curve_t, trim_loop_t, spline_curves, max_trim_degree
  use trim_loops, only: trim_surface
  use iges_model, only: iges_model_t, values_t, open_values, get_integer, get_reals, get_entry, &
                        reject, reject_entity, transform
  use iges_surfaces, only: read_surface, read_curve
  implicit none
  private

  public :: read_trimmed

  character(*), parameter :: converter = "a file from `python -m post cad`, which makes them"

contains

  !> Read a surface of type 144, or any other, in the unit of the file. It is of use only if the
  !! model is valid afterwards.
  subroutine read_trimmed(model, entry, surface)
    type(iges_model_t), intent(inout) :: model
    integer, intent(in) :: entry
    type(nurbs_surface_t), intent(out) :: surface
    type(values_t) :: values
    integer :: base

    if (model%entries(entry)%type /= 144) then
      call read_surface(model, entry, surface)
      return
    end if
    model%is_valid = .true.
    call open_values(model, entry, values)
    base = 0
    if (model%is_valid) base = get_entry(model, values, 1, "the surface that is trimmed")
    if (.not. model%is_valid) return
    if (model%entries(base)%type /= 128) then
      call reject_entity(model, entry, "a trimmed surface of type "// &
                         to_text(model%entries(base)%type), "a rational B-spline surface "// &
                         "(128), or "//converter)
      return
    end if
    call read_surface(model, base, surface)
    if (model%is_valid) call place(model, entry, surface)
    if (model%is_valid) call read_loops(model, values, base, surface)
  end subroutine read_trimmed

  !> Apply the transformation of the trimmed surface itself.
  subroutine place(model, entry, surface)
    type(iges_model_t), intent(inout) :: model
    integer, intent(in) :: entry
    type(nurbs_surface_t), intent(inout) :: surface
    real(wp), allocatable :: points(:, :)

    points = reshape(surface%points, [size(surface%weights), 3])
    call transform(model, entry, points)
    surface%points = reshape(points, shape(surface%points))
  end subroutine place

  !> Read the loops and trim the surface by them.
  subroutine read_loops(model, values, base, surface)
    type(iges_model_t), intent(inout) :: model
    type(values_t), intent(in) :: values     !! of the trimmed surface
    integer, intent(in) :: base              !! entry of the surface that is trimmed
    type(nurbs_surface_t), intent(inout) :: surface
    type(trim_loop_t), allocatable :: loops(:)
    type(error_t), allocatable :: error
    real(wp), parameter :: open = 1.0e-4_wp   ! gap that is closed, of the size of the surface
    real(wp) :: extent
    integer :: has_outer, n_inner, i, n, c

    has_outer = get_integer(model, values, 2, "N1, whether there is an outer loop", 0, 1)
    n_inner = get_integer(model, values, 3, "N2, the number of inner loops", 0, &
                          max(0, values%n - 3))
    if (.not. model%is_valid) return
    if (values%n < 3 + n_inner + merge(1, has_outer, n_inner > 0)) then
      call reject(model, values, 3, counted(values%n, "parameter"), to_text(4 + n_inner)// &
                  " for "//counted(n_inner, "inner loop"))
      return
    end if
    allocate (loops(has_outer + n_inner))
    n = 0
    do i = 1 - has_outer, n_inner
      n = n + 1
      call read_loop(model, values, 4 + i, base, loops(n))
      if (.not. model%is_valid) return
    end do
    if (n == 0) return
    extent = norm2([(maxval(surface%points(:, :, c)) - minval(surface%points(:, :, c)), c=1, 3)])
    call trim_surface(surface, loops, has_outer == 1, &
                      max(model%global%resolution, open*extent), error)
    if (allocated(error)) call reject_entity(model, values%entry, "a trim that is not usable: "// &
      error%message, "loops that are closed, simple and within the surface")
  end subroutine read_loops

  !> Read one curve on a surface.
  subroutine read_loop(model, outer, at, base, loop)
    type(iges_model_t), intent(inout) :: model
    type(values_t), intent(in) :: outer      !! values of the trimmed surface
    integer, intent(in) :: at, base
    type(trim_loop_t), intent(out) :: loop
    type(values_t) :: values
    integer :: entry, surface, curve

    entry = get_entry(model, outer, at, "a loop")
    if (.not. model%is_valid) return
    if (model%entries(entry)%type /= 142) then
      call reject(model, outer, 1, "entity "//to_text(model%entries(entry)%type)//" as a loop", &
                  "a curve on a surface (142)")
      return
    end if
    call open_values(model, entry, values)
    surface = get_entry(model, values, 2, "the surface of the curve")
    curve = get_integer(model, values, 3, "the curve in the parameter plane", 0, &
                        2*size(model%entries) - 1)
    if (.not. model%is_valid) return
    if (surface /= base) then
      call reject(model, values, 1, "a curve on the surface at D"//to_text(2*surface - 1), &
                  "one on the surface that it trims, at D"//to_text(2*base - 1))
    else if (curve == 0) then
      call reject_entity(model, outer%entry, "a face whose loop at D"//to_text(2*entry - 1)// &
                         start_of_loop(model, outer%entry, values)//" has no curve in the "// &
                         "parameter plane", converter)
    else
      curve = get_entry(model, values, 3, "the curve in the parameter plane")
      allocate (loop%curves(0))
      if (model%is_valid) call add_curves(model, curve, loop)
    end if
  end subroutine read_loop

  !> Where the curve in space of a loop begins, in words; empty without one that can be read. What
  !! is wrong with that curve is no error: nothing is made of it.
  function start_of_loop(model, face, loop) result(words)
    type(iges_model_t), intent(inout) :: model
    integer, intent(in) :: face              !! entry of the trimmed surface
    type(values_t), intent(in) :: loop       !! of its curve on a surface
    character(:), allocatable :: words
    type(nurbs_curve_t) :: curve
    integer :: entry, n_before

    words = ""
    if (loop%n < 4) return
    n_before = model%file%errors%n_items
    entry = get_integer(model, loop, 4, "the curve in space", 0, 2*size(model%entries) - 1)
    if (model%is_valid .and. entry > 0) then
      entry = get_entry(model, loop, 4, "the curve in space")
      if (model%is_valid) call read_curve(model, entry, curve)
      if (model%is_valid) call transform(model, face, curve%points)
      if (model%is_valid) words = ", which begins at "//place_text(curve%points(1, :))//","
    end if
    model%file%errors%n_items = n_before
  end function start_of_loop

  !> Append a curve of the parameter plane, or the curves that it is made of.
  subroutine add_curves(model, entry, loop)
    type(iges_model_t), intent(inout) :: model
    integer, intent(in) :: entry
    type(trim_loop_t), intent(inout) :: loop
    type(trim_curve_t), allocatable :: curves(:)
    type(values_t) :: values
    integer :: i, n, part

    if (model%entries(entry)%type /= 102) then
      call read_flat_curve(model, entry, curves)
      if (model%is_valid) loop%curves = [loop%curves, curves]
      return
    end if
    call open_values(model, entry, values)
    n = get_integer(model, values, 1, "the number of curves", 1, max(1, values%n - 1))
    if (.not. model%is_valid) return
    do i = 1, n
      part = get_entry(model, values, 1 + i, "a curve")
      if (.not. model%is_valid) return
      if (model%entries(part)%type == 102) then
        call reject(model, values, 1, "a composite curve made of composite curves", &
                    "one made of plain curves")
        return
      end if
      call read_flat_curve(model, part, curves)
      if (.not. model%is_valid) return
      loop%curves = [loop%curves, curves]
    end do
  end subroutine add_curves

  !> Bezier pieces of a plain curve whose x and y are the parameters of the surface.
  subroutine read_flat_curve(model, entry, curves)
    type(iges_model_t), intent(inout) :: model
    integer, intent(in) :: entry
    type(trim_curve_t), allocatable, intent(out) :: curves(:)
    type(nurbs_curve_t) :: curve
    type(values_t) :: values

    if (model%entries(entry)%type == 126) then
      call open_values(model, entry, values)
      if (model%is_valid) call read_flat_spline(model, values, curves)
      return
    end if
    call read_curve(model, entry, curve)
    if (.not. model%is_valid) return
    call spline_curves(curve%axis%degree, curve%axis%knots, &
                       homogeneous(curve%points, curve%weights), curve%axis%knots(1), &
                       curve%axis%knots(size(curve%axis%knots)), curves)
  end subroutine read_flat_curve

  !> Points (w u, w v, w), shape (3, n).
  pure function homogeneous(points, weights) result(c)
    real(wp), intent(in) :: points(:, :), weights(:)
    real(wp) :: c(3, size(weights))

    c(1, :) = points(:, 1)*weights
    c(2, :) = points(:, 2)*weights
    c(3, :) = weights
  end function homogeneous

  !> A rational B-spline curve (126), of degrees that no surface may have, too.
  subroutine read_flat_spline(model, values, curves)
    type(iges_model_t), intent(inout) :: model
    type(values_t), intent(in) :: values
    type(trim_curve_t), allocatable, intent(out) :: curves(:)
    real(wp), allocatable :: knots(:), weights(:), points(:, :)
    real(wp) :: range(2)
    integer :: k, m, at

    k = get_integer(model, values, 1, "K, the upper index", 1, max(1, values%n))
    m = get_integer(model, values, 2, "M, the degree", 1, max_trim_degree)
    if (.not. model%is_valid) return
    if (6 + (k + m + 2) + 4*(k + 1) + 2 > values%n .or. k < m) then
      call reject(model, values, 1, counted(values%n, "parameter")//" for K = "//to_text(k)// &
                  " and M = "//to_text(m), "K of at least M, and all values of so many points")
      return
    end if
    knots = get_reals(model, values, 7, k + m + 2, "a knot")
    at = 7 + k + m + 2
    weights = get_reals(model, values, at, k + 1, "a weight")
    at = at + k + 1
    points = transpose(reshape(get_reals(model, values, at, 3*(k + 1), "a coordinate"), [3, k + 1]))
    range = get_reals(model, values, at + 3*(k + 1), 2, "the range")
    if (.not. model%is_valid) return
    if (.not. range(1) < range(2)) range = [knots(m + 1), knots(k + 2)]
    range = [max(range(1), knots(m + 1)), min(range(2), knots(k + 2))]
    if (any(knots(2:) < knots(:k + m + 1)) .or. .not. range(1) < range(2)) then
      call reject(model, values, 1, "knots that fall, or a range without length", &
                  "knots that do not fall, and a range within them")
    else if (.not. all(weights > 0.0_wp)) then
      call reject(model, values, 1, "a weight that is not positive", "weights above 0")
    else
      call transform(model, values%entry, points)
      call spline_curves(m, knots, homogeneous(points, weights), range(1), range(2), curves)
    end if
  end subroutine read_flat_spline

end module iges_trims
