!> What `igaform --check` tells of a smaller scene that would do.
module saving_report
  use kinds, only: wp
  use text, only: string_t, to_text, append_text
  use basis_tables, only: n_lanes
  use knot_vector, only: n_spans
  use scene, only: scene_t
  use scene_symmetry, only: axis_along, uniformity_problem, mirror_problem
  implicit none
  private

  public :: saving_lines

contains

  !> The strip and the symmetry planes that a scene qualifies for, with the share of the cost that
  !! each would save: elements are worked eight at a time along their first axis.
  function saving_lines(scene) result(lines)
    type(scene_t), intent(in) :: scene
    type(string_t), allocatable :: lines(:)
    character(3), parameter :: letters = "xyz"
    integer :: c, axis, n(3), reduced(3)

    allocate (lines(0))
    if (size(scene%blank%patches) > 1) return
    if (scene%reduction%component >= 0) then
      call append_text(lines, "reduction        plane strain, results for the full width")
      return
    end if
    n = elements(scene)
    do c = 1, 3
      axis = axis_along(scene, c)
      if (axis == 0) cycle
      reduced = n
      reduced(axis) = 1
      if (.not. cost(reduced) < cost(n)) cycle
      if (uniformity_problem(scene, c) == "") call append_text(lines, "could be         "// &
        "a strip (*REDUCE, TYPE=PLANE STRAIN, AXIS="//letters(c:c)//"), uniform along "// &
        letters(c:c)//": 1 of "//to_text(n(axis))//" elements, saves "// &
        percent(1.0_wp - cost(reduced)/cost(n))//"; exact where the edges are held; with "// &
        "free edges for bending, not for pulling, in which a sheet narrows")
    end do
    do c = 1, 3
      if (mirror_problem(scene, c) /= "") cycle
      do axis = 1, 2
        if (.not. varies_along(scene, axis, c)) cycle
        reduced = n
        reduced(axis) = (n(axis) + 1)/2
        if (.not. cost(reduced) < cost(n)) cycle
        call append_text(lines, "could be         one half (cut the blank, *BOUNDARY "//upper(c)// &
                 "SYMM on the cut), symmetric in "//letters(c:c)//": saves "// &
                 percent(1.0_wp - cost(reduced)/cost(n)))
      end do
    end do
  end function saving_lines

  pure function elements(scene) result(n)
    type(scene_t), intent(in) :: scene
    integer :: n(3), axis

    do axis = 1, 3
      n(axis) = n_spans(scene%blank%patches(1)%solid%axes(axis))
    end do
  end function elements

  !> Is this the axis of the blank that runs across the plane?
  pure logical function varies_along(scene, axis, component)
    type(scene_t), intent(in) :: scene
    integer, intent(in) :: axis, component
    real(wp) :: ends(3)

    associate (points => scene%blank%patches(1)%solid%points)
      if (axis == 1) then
        ends = abs(points(size(points, 1), 1, 1, :) - points(1, 1, 1, :))
      else
        ends = abs(points(1, size(points, 2), 1, :) - points(1, 1, 1, :))
      end if
    end associate
    varies_along = ends(component) >= maxval(ends)
  end function varies_along

  pure real(wp) function cost(n)
    integer, intent(in) :: n(3)

    cost = real(n_lanes*((n(1) + n_lanes - 1)/n_lanes)*n(2)*n(3), wp)
  end function cost

  pure character(1) function upper(component)
    integer, intent(in) :: component
    character(3), parameter :: letters = "XYZ"

    upper = letters(component:component)
  end function upper

  pure function percent(share) result(text)
    real(wp), intent(in) :: share
    character(:), allocatable :: text

    text = to_text(nint(100.0_wp*share))//" % of the elements' cost"
  end function percent

end module saving_report
