!> How many pieces of the sheet a cut leaves: more or fewer than the deck names are an error, for a
!! hole in a wrong place leaves a piece as well.
module blank_pieces
  use kinds, only: wp
  use failure, only: error_t, fail
  use text, only: to_text, place_text, counted
  use knot_vector, only: breaks
  use nurbs_surface, only: nurbs_surface_t, evaluate_surface
  use outline, only: region_t, n_moments, cut_cells
  use region_parts, only: region_parts_t, find_parts, find_groups
  use element, only: element_t
  implicit none
  private

  public :: check_pieces

  real(wp), parameter :: round_off = 1.0e-9_wp      !! of the area of an element

contains

  !> Refuse another number of pieces than the deck names, with the place of the smallest.
  !!
  !! A piece is what hangs together within the last region. Where earlier regions have cut the same
  !! elements it is not known what they have taken of which part. Then only pieces with an element
  !! that they have left alone count, and there may be more.
  subroutine check_pieces(element, region, surface, n_meant, error)
    class(element_t), intent(in) :: element           !! after the cut
    type(region_t), intent(in) :: region              !! of the cut, the last of the element
    type(nurbs_surface_t), intent(in) :: surface      !! mid-surface of the sheet as it lies
    integer, intent(in) :: n_meant
    type(error_t), allocatable, intent(out) :: error
    type(region_parts_t) :: parts
    integer, allocatable :: group(:)
    real(wp), allocatable :: sizes(:)                 ! of the groups, in elements
    integer :: n, smallest

    call find_parts(region, breaks(surface%axes(1)), breaks(surface%axes(2)), element%ties%share, &
                    parts)
    call find_groups(parts, group, n)
    call find_sizes(element, region, surface, parts, group, n, sizes)
    n = count(sizes > 0.0_wp)
    if (n > n_meant) then
      smallest = minloc(sizes, 1, sizes > 0.0_wp)
      call fail(error, "curves that leave "//counted(n, "piece")//" of the sheet, the smallest "// &
                "around "//place_text(place_of(surface, parts, group, smallest, &
                element%ties%share))//", and PIECES="//to_text(n_meant))
    else if (n < n_meant .and. size(element%regions) == 1) then
      call fail(error, "curves that leave "//counted(n, "piece")//" of the sheet, and PIECES="// &
                to_text(n_meant))
    end if
  end subroutine check_pieces

  !> Elements of each group; 0 for those that may not be there.
  subroutine find_sizes(element, region, surface, parts, group, n, sizes)
    class(element_t), intent(in) :: element
    type(region_t), intent(in) :: region
    type(nurbs_surface_t), intent(in) :: surface
    type(region_parts_t), intent(in) :: parts
    integer, intent(in) :: group(:), n                !! of each part, and their number
    real(wp), allocatable, intent(out) :: sizes(:)
    real(wp) :: moments(n_moments, size(element%ties%share, 1), size(element%ties%share, 2))
    logical :: is_there(n)
    integer :: k

    is_there = size(element%regions) == 1
    if (.not. all(is_there)) call cut_cells([region], breaks(surface%axes(1)), &
                                            breaks(surface%axes(2)), moments)
    allocate (sizes(n), source=0.0_wp)
    do k = 1, parts%n
      associate (i => parts%cell(1, k), j => parts%cell(2, k), g => group(k))
        sizes(g) = sizes(g) + element%ties%share(i, j)/(parts%last(i, j) - parts%first(i, j) + 1)
        if (.not. is_there(g)) is_there(g) = 0.25_wp*moments(1, i, j) &
                                             <= element%ties%share(i, j) + round_off
      end associate
    end do
    where (.not. is_there) sizes = 0.0_wp
  end subroutine find_sizes

  !> The middle of that element of a group of which most is there.
  pure function place_of(surface, parts, group, wanted, share) result(x)
    type(nurbs_surface_t), intent(in) :: surface
    type(region_parts_t), intent(in) :: parts
    integer, intent(in) :: group(:), wanted
    real(wp), intent(in) :: share(:, :)
    real(wp), allocatable :: lines1(:), lines2(:)
    real(wp) :: x(3)
    integer :: k, at

    at = maxloc([(share(parts%cell(1, k), parts%cell(2, k)), k=1, parts%n)], 1, group == wanted)
    lines1 = breaks(surface%axes(1))
    lines2 = breaks(surface%axes(2))
    associate (i => parts%cell(1, at), j => parts%cell(2, at))
      call evaluate_surface(surface, 0.5_wp*[lines1(i) + lines1(i + 1), &
                                             lines2(j) + lines2(j + 1)], x)
    end associate
  end function place_of

end module blank_pieces
