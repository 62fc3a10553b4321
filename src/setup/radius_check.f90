!> Are the elements of the blank fit for the radii of a tool? A geometric forecast, before the run.
module radius_check
  use kinds, only: wp
  use text, only: rounded_text, place_text
  use input_errors, only: origin_t, error_list_t, add_warning
  use knot_vector, only: n_spans
  use nurbs_surface, only: nurbs_surface_t, evaluate_surface
  use surface_grid, only: lines
  use blank, only: blank_t
  use tool, only: tool_t
  use tool_bends, only: bend_t, tool_bends_below, elements_on_radius
  implicit none
  private

  public :: check_radii

  integer, parameter :: most_elements = 20000   !! looked at; of more every n-th

  !> An element of a face of the blank.
  type :: element_t
    real(wp) :: x(3) = 0.0_wp          !! its middle [length]
    real(wp) :: way(3, 2) = 0.0_wp     !! unit vectors along its two directions
    real(wp) :: size(2) = 0.0_wp       !! length along them [length]
  end type element_t

contains

  !> Warn where a tool bends towards the sheet with a radius that is shorter than three of the
  !! elements nearest to it, measured along the bend. Bends that look away from the sheet do not
  !! count.
  subroutine check_radii(blank, face, across, tool, origin, errors)
    type(blank_t), intent(in) :: blank
    integer, intent(in) :: face            !! of the blank against the tool
    integer, intent(in) :: across          !! direction along which a strip does not change, 0: none
    type(tool_t), intent(in) :: tool
    type(origin_t), intent(in) :: origin   !! of the warning
    type(error_list_t), intent(inout) :: errors
    type(element_t), allocatable :: elements(:)
    type(bend_t), allocatable :: bends(:)
    type(bend_t) :: worst
    character(:), allocatable :: expected
    real(wp), parameter :: alike = 1.0e-3_wp
    real(wp) :: ratio, least, size_along, size_there, distance, nearest
    integer :: i

    elements = elements_of(blank, face, across)
    call tool_bends_below(tool, elements_on_radius*maxval([(maxval(elements(i)%size), &
                                                            i=1, size(elements))]), bends)
    least = elements_on_radius*(1.0_wp - alike)
    nearest = huge(1.0_wp)
    size_there = 0.0_wp
    do i = 1, size(bends)
      call find_element(elements, bends(i), tool%displacement, size_along, distance)
      if (.not. size_along > 0.0_wp) cycle
      ratio = bends(i)%radius/size_along
      ! Of places that bend alike the nearest is told.
      if (ratio > least*(1.0_wp + alike)) cycle
      if (ratio >= least*(1.0_wp - alike) .and. distance >= nearest) cycle
      least = min(ratio, least)
      nearest = distance
      worst = bends(i)
      size_there = size_along
    end do
    if (.not. size_there > 0.0_wp) return
    expected = "a radius of three elements: between contact points an edge goes unseen"
    if (worst%radius > 0.0_wp) expected = "elements of at most "// &
      rounded_text(worst%radius/elements_on_radius)//" there, a third of the radius"
    call add_warning(errors, origin, found_words(tool, worst, size_there), expected)
  end subroutine check_radii

  !> What the deck has.
  function found_words(tool, bend, size_there) result(found)
    type(tool_t), intent(in) :: tool
    type(bend_t), intent(in) :: bend
    real(wp), intent(in) :: size_there     !! of the elements [length]
    character(:), allocatable :: found

    found = "tool '"//tool%name//"' with "
    if (bend%radius > 0.0_wp) then
      found = found//"the radius "//rounded_text(bend%radius)
    else
      found = found//"a sharp edge"
    end if
    found = found//" at "//place_text(bend%x + tool%displacement)//", where the elements are "// &
            rounded_text(size_there)//" long"
  end function found_words

  !> Length along a bend of the element nearest to it, 0 where the bend looks away from it, and how
  !! far away its middle is.
  pure subroutine find_element(elements, bend, shift, length, distance)
    type(element_t), intent(in) :: elements(:)
    type(bend_t), intent(in) :: bend
    real(wp), intent(in) :: shift(3)       !! of the tool [length]
    real(wp), intent(out) :: length, distance   !! [length]
    real(wp) :: least, square
    integer :: i, nearest

    least = huge(1.0_wp)
    nearest = 1
    do i = 1, size(elements)
      square = sum((elements(i)%x - bend%x - shift)**2)
      if (square >= least) cycle
      least = square
      nearest = i
    end do
    length = 0.0_wp
    distance = sqrt(least)
    associate (element => elements(nearest))
      if (sum((element%x - bend%x - shift)*bend%normal) <= 0.0_wp) return
      i = maxloc(abs(matmul(bend%way, element%way)), 1)
      length = element%size(i)
    end associate
  end subroutine find_element

  !> The elements of a face of all patches where it is not joined to another.
  function elements_of(blank, face, across) result(elements)
    type(blank_t), intent(in) :: blank
    integer, intent(in) :: face, across
    type(element_t), allocatable :: elements(:)
    type(nurbs_surface_t) :: surface
    type(element_t), allocatable :: of_patch(:)
    integer :: p

    allocate (elements(0))
    do p = 1, size(blank%parts)
      surface = blank%parts(p)%element%surface(face)
      call find_elements(surface, across, of_patch)
      elements = [elements, of_patch]
    end do
    p = (size(elements) + most_elements - 1)/most_elements
    elements = elements(::p)
  end function elements_of

  !> The elements of a surface.
  subroutine find_elements(surface, across, elements)
    type(nurbs_surface_t), intent(in) :: surface
    integer, intent(in) :: across
    type(element_t), allocatable, intent(out) :: elements(:)
    real(wp), allocatable :: xi(:), eta(:)
    real(wp) :: d1(3, 2)
    integer :: i, j, n, d

    xi = lines(surface%axes(1), 2)
    eta = lines(surface%axes(2), 2)
    allocate (elements(n_spans(surface%axes(1))*n_spans(surface%axes(2))))
    n = 0
    do j = 2, size(eta), 2
      do i = 2, size(xi), 2
        n = n + 1
        associate (element => elements(n))
          call evaluate_surface(surface, [xi(i), eta(j)], element%x, d1)
          element%size = norm2(d1, 1)*[xi(i + 1) - xi(i - 1), eta(j + 1) - eta(j - 1)]
          do d = 1, 2
            if (d /= across) element%way(:, d) = d1(:, d)/max(norm2(d1(:, d)), tiny(1.0_wp))
          end do
        end associate
      end do
    end do
  end subroutine find_elements

end module radius_check
