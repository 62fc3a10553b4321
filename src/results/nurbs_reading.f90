!> The exact geometry of blank and tools out of a results file, as `nurbs_record` wrote it.
module nurbs_reading
  use kinds, only: wp
  use errors, only: error_t, fail
  use text, only: string_t, to_text
  use knot_vector, only: knot_vector_t, new_knot_vector
  use nurbs_surface, only: nurbs_surface_t, new_nurbs_surface
  use nurbs_solid, only: nurbs_solid_t, new_nurbs_solid
  use hdf5_library, only: hid_t
  use hdf5_reading, only: open_for_reading, close_reading, read_numbers, read_text_attribute, &
                          names_in
  implicit none
  private

  public :: shapes_t, read_shapes

  !> A tool and its surfaces.
  type :: tool_shape_t
    character(:), allocatable :: name
    type(nurbs_surface_t), allocatable :: surfaces(:)   !! last frame
  end type tool_shape_t

  !> What a file holds.
  type :: shapes_t
    type(nurbs_solid_t), allocatable :: solids(:)       !! patches of the blank, last frame
    type(string_t), allocatable :: patches(:)           !! their names
    type(tool_shape_t), allocatable :: tools(:)
    character(:), allocatable :: unit                   !! of length, as the deck calls it
  end type shapes_t

  public :: tool_shape_t

contains

  !> Read all shapes. Fails if the file cannot be read or holds shapes that are none.
  subroutine read_shapes(path, shapes, error)
    character(*), intent(in) :: path
    type(shapes_t), intent(out) :: shapes
    type(error_t), allocatable, intent(out) :: error
    integer(hid_t) :: file
    type(string_t), allocatable :: names(:)
    integer :: i

    file = open_for_reading(path)
    if (file < 0) then
      call fail(error, "result file '"//path//"' cannot be read")
      return
    end if
    names = names_in(file, "/nurbs/blank")
    shapes%patches = names
    if (any([(names(i)%value == "degrees", i=1, size(names))])) then
      deallocate (shapes%patches)
      allocate (shapes%patches(1))
      shapes%patches(1)%value = ""
    end if
    allocate (shapes%solids(size(shapes%patches)))
    shapes%unit = ""
    do i = 1, size(shapes%patches)
      if (.not. allocated(error)) call read_solid(file, folder_of_patch(shapes%patches(i)%value), &
                                                  shapes%solids(i), shapes%unit, error)
    end do
    names = names_in(file, "/nurbs/tools")
    allocate (shapes%tools(size(names)))
    do i = 1, size(names)
      shapes%tools(i)%name = names(i)%value
      if (.not. allocated(error)) call read_tool(file, shapes%tools(i), error)
    end do
    call close_reading(file)
    if (allocated(error)) error%message = "result file '"//path//"': "//error%message
    if (.not. allocated(error) .and. size(shapes%solids) == 0) &
      call fail(error, "result file '"//path//"' has no shapes under /nurbs")
  end subroutine read_shapes

  pure function folder_of_patch(name) result(folder)
    character(*), intent(in) :: name
    character(:), allocatable :: folder

    folder = "/nurbs/blank"
    if (name /= "") folder = folder//"/"//name
  end function folder_of_patch

  subroutine read_tool(file, tool, error)
    integer(hid_t), intent(in) :: file
    type(tool_shape_t), intent(inout) :: tool
    type(error_t), allocatable, intent(out) :: error
    character(:), allocatable :: folder
    integer :: i

    folder = "/nurbs/tools/"//tool%name
    allocate (tool%surfaces(size(names_in(file, folder))))
    do i = 1, size(tool%surfaces)
      call read_surface(file, folder//"/surface_"//to_text(i), tool%surfaces(i), error)
      if (allocated(error)) return
    end do
  end subroutine read_tool

  subroutine read_surface(file, folder, surface, error)
    integer(hid_t), intent(in) :: file
    character(*), intent(in) :: folder
    type(nurbs_surface_t), intent(out) :: surface
    type(error_t), allocatable, intent(out) :: error
    type(knot_vector_t) :: axes(2)
    real(wp), allocatable :: points(:), weights(:)
    integer :: n(2)

    call read_grid(file, folder, axes, points, weights, error)
    if (allocated(error)) return
    n = axes%n_basis
    call new_nurbs_surface(surface, axes(1), axes(2), &
                           reshape(points, [n(1), n(2), 3], order=[3, 1, 2]), &
                           reshape(weights, n), error)
  end subroutine read_surface

  subroutine read_solid(file, folder, solid, unit, error)
    integer(hid_t), intent(in) :: file
    character(*), intent(in) :: folder
    type(nurbs_solid_t), intent(out) :: solid
    character(:), allocatable, intent(inout) :: unit
    type(error_t), allocatable, intent(out) :: error
    type(knot_vector_t) :: axes(3)
    real(wp), allocatable :: points(:), weights(:)
    integer :: n(3)

    unit = read_text_attribute(file, folder//"/points", "unit")
    call read_grid(file, folder, axes, points, weights, error)
    if (allocated(error)) return
    n = axes%n_basis
    call new_nurbs_solid(solid, axes, reshape(points, [n, 3], order=[4, 1, 2, 3]), &
                         reshape(weights, n), error)
  end subroutine read_solid

  !> Knot vectors, control points (components first) and weights; their numbers fit each other.
  subroutine read_grid(file, folder, axes, points, weights, error)
    integer(hid_t), intent(in) :: file
    character(*), intent(in) :: folder
    type(knot_vector_t), intent(out) :: axes(:)
    real(wp), allocatable, intent(out) :: points(:), weights(:)
    type(error_t), allocatable, intent(out) :: error
    real(wp), allocatable :: degrees(:), knots(:)
    integer :: axis

    call read_numbers(file, folder//"/degrees", degrees)
    call read_numbers(file, folder//"/points", points)
    call read_numbers(file, folder//"/weights", weights)
    if (.not. (allocated(degrees) .and. allocated(points) .and. allocated(weights))) then
      call fail(error, "no degrees, points or weights at "//folder)
      return
    end if
    do axis = 1, size(axes)
      call read_numbers(file, folder//"/knots_"//to_text(axis), knots)
      if (.not. allocated(knots) .or. size(degrees) /= size(axes)) then
        call fail(error, "no knots of axis "//to_text(axis)//" at "//folder)
      else
        call new_knot_vector(axes(axis), nint(degrees(axis)), knots, error)
      end if
      if (allocated(error)) return
    end do
    if (size(weights) /= product(axes%n_basis) .or. size(points) /= 3*size(weights)) then
      call fail(error, "points and knots that do not fit each other at "//folder)
    end if
  end subroutine read_grid

end module nurbs_reading
