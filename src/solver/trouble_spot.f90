!> Where in the blank a run went wrong. Looked for only when it has, so the steps pay nothing.
module trouble_spot
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  use kinds, only: wp
  use text, only: to_text, place_text
  use basis_tables, only: n_lanes
  use nurbs_solid, only: nurbs_solid_t
  use slave_surface, only: point_position
  use point_volumes, only: jacobian_at, determinant, inverse_rows
  use ig_patch, only: element_of_lane
  use patch_body, only: patch_body_t
  use blank, only: blank_t
  use large_shear, only: sheet_shear, equivalent_strain
  use contact, only: contact_t
  use tool, only: tool_t
  use tool_face, only: face_position
  implicit none
  private

  public :: spot_t, spot_of_failure, spot_of_smallest, most_sheared, words_of, fastest_place
  public :: deepest_place, contact_place

  !> A point of the rule in an element of a patch.
  type :: spot_t
    integer :: part = 0                       !! patch of the blank, 0: no spot was found
    integer :: element(3) = 0, point(3) = 0   !! along xi, eta, zeta
    real(wp) :: place(3) = 0.0_wp             !! [length]
    logical :: is_place_at_start = .false.    !! for it is nowhere now
  end type spot_t

contains

  !> The point to blame in the block that failed: one with values that are no numbers, or the one
  !! that is turned inside out most. None is found where a law gave up on sound values.
  function spot_of_failure(blank) result(spot)
    type(blank_t), intent(in) :: blank
    type(spot_t) :: spot
    type(nurbs_solid_t) :: solid
    real(wp) :: j(3, 3), least, det
    integer :: lane, q(3), qa, qb, qc, e(3), row

    associate (body => blank%parts(blank%report%failed_patch), block => blank%report%failed_block)
      solid = solid_now(body)
      q = body%patch%axes%n_points
      least = 0.0_wp
      do lane = 1, n_lanes
        e = element_of_lane(body%patch, block, lane)
        do qc = 1, q(3)
          do qb = 1, q(2)
            do qa = 1, q(1)
              row = qb + q(2)*(qa - 1)
              call jacobian_at(body%patch, solid, e, [qa, qb, qc], j)
              det = determinant(j)
              if (all(ieee_is_finite(body%patch%stress(lane, qc, :, row, block))) .and. &
                  all(ieee_is_finite(body%patch%state(lane, qc, :, row, block)))) then
                if (det > least) cycle   ! not for a NaN
              else
                det = -huge(det)
              end if
              if (spot%part > 0 .and. .not. det < least) cycle
              spot = new_spot(blank%report%failed_patch, e, [qa, qb, qc])
              if (det < least) least = det
            end do
          end do
        end do
      end do
      if (spot%part > 0) call set_place(body, solid, spot)
    end associate
  end function spot_of_failure

  !> The point whose jacobian has the largest inverse, which asks for the smallest step.
  function spot_of_smallest(blank) result(spot)
    type(blank_t), intent(in) :: blank
    type(spot_t) :: spot
    type(nurbs_solid_t) :: solid
    real(wp) :: j(3, 3), rate, largest
    integer :: p, block, lane, q(3), qa, qb, qc, e(3)

    largest = -1.0_wp
    do p = 1, size(blank%parts)
      associate (body => blank%parts(p))
        solid = solid_now(body)
        q = body%patch%axes%n_points
        do block = 1, body%patch%n_blocks
          do lane = 1, n_lanes
            e = element_of_lane(body%patch, block, lane)
            do qc = 1, q(3)
              do qb = 1, q(2)
                do qa = 1, q(1)
                  call jacobian_at(body%patch, solid, e, [qa, qb, qc], j)
                  rate = sum(inverse_rows(j)**2)
                  if (.not. rate > largest) cycle
                  largest = rate
                  spot = new_spot(p, e, [qa, qb, qc])
                end do
              end do
            end do
          end do
        end do
        if (spot%part == p) call set_place(body, solid, spot)
      end associate
    end do
  end function spot_of_smallest

  !> The point with the largest simple shear, see `sheet_shear`, among those most strained of
  !! their elements; no spot where none can have sheared by one.
  subroutine most_sheared(blank, spot, shear)
    type(blank_t), intent(in) :: blank
    type(spot_t), intent(out) :: spot
    real(wp), intent(out) :: shear
    type(nurbs_solid_t) :: solid
    real(wp) :: here
    integer :: p, block, lane, q(3), row_point(2), e(3), point(3)

    shear = 0.0_wp
    do p = 1, size(blank%parts)
      associate (body => blank%parts(p))
        solid = solid_now(body)
        q = body%patch%axes%n_points
        do block = 1, body%patch%n_blocks
          do lane = 1, n_lanes
            row_point = most_strained(blank, p, block, lane)
            if (row_point(1) == 0) cycle
            e = element_of_lane(body%patch, block, lane)
            point = [(row_point(1) - 1)/q(2) + 1, mod(row_point(1) - 1, q(2)) + 1, row_point(2)]
            here = shear_at(body, solid, e, point)
            if (.not. here > shear) cycle
            shear = here
            spot = new_spot(p, e, point)
          end do
        end do
        if (spot%part == p) call set_place(body, solid, spot)
      end associate
    end do
  end subroutine most_sheared

  !> Row and number in it of the point of an element that is strained most, zeros where it is
  !! strained less than a simple shear of one would.
  pure function most_strained(blank, part, block, lane) result(row_point)
    type(blank_t), intent(in) :: blank
    integer, intent(in) :: part, block, lane
    integer :: row_point(2), row, qc
    real(wp), parameter :: least = 0.5_wp
    real(wp) :: strain, largest

    row_point = 0
    largest = least
    associate (patch => blank%parts(part)%patch)
      do row = 1, size(patch%stress, 4)
        do qc = 1, size(patch%stress, 2)
          strain = equivalent_strain(blank%law, patch%stress(lane, qc, :, row, block), &
                                     patch%state(lane, qc, :, row, block))
          if (.not. strain > largest) cycle
          largest = strain
          row_point = [row, qc]
        end do
      end do
    end associate
  end function most_strained

  !> Simple shear of a point since the start.
  pure real(wp) function shear_at(body, now, element, point) result(shear)
    type(patch_body_t), intent(in) :: body
    type(nurbs_solid_t), intent(in) :: now
    integer, intent(in) :: element(3), point(3)
    real(wp) :: start(3, 3), j(3, 3)

    call jacobian_at(body%patch, body%solid, element, point, start)
    call jacobian_at(body%patch, now, element, point, j)
    shear = sheet_shear(start, j)
  end function shear_at

  !> The patch in its present shape.
  pure function solid_now(body) result(solid)
    type(patch_body_t), intent(in) :: body
    type(nurbs_solid_t) :: solid

    solid = body%solid
    solid%points = body%motion%x
  end function solid_now

  pure function new_spot(part, element, point) result(spot)
    integer, intent(in) :: part, element(3), point(3)
    type(spot_t) :: spot

    spot%part = part
    spot%element = element
    spot%point = point
  end function new_spot

  !> Where the point is now, or was at the start if that is no number.
  pure subroutine set_place(body, solid, spot)
    type(patch_body_t), intent(in) :: body
    type(nurbs_solid_t), intent(in) :: solid
    type(spot_t), intent(inout) :: spot
    real(wp) :: j(3, 3)

    call jacobian_at(body%patch, solid, spot%element, spot%point, j, spot%place)
    spot%is_place_at_start = .not. all(abs(spot%place) < 1.0e100_wp)
    if (spot%is_place_at_start) &
      call jacobian_at(body%patch, body%solid, spot%element, spot%point, j, spot%place)
  end subroutine set_place

  !> The spot in words, such as `element (3, 1, 2), point (1, 1, 2), at (10.5, 0.2, 0)`.
  function words_of(blank, spot) result(words)
    type(blank_t), intent(in) :: blank
    type(spot_t), intent(in) :: spot
    character(:), allocatable :: words

    words = ""
    if (size(blank%parts) > 1) words = "patch '"//blank%parts(spot%part)%name//"', "
    words = words//"element "//triple(spot%element)//", point "//triple(spot%point)// &
            " along xi, eta, zeta, at "//place_text(spot%place)
    if (spot%is_place_at_start) words = words//" in the shape at the start"
  end function words_of

  pure function triple(counts) result(words)
    integer, intent(in) :: counts(3)
    character(:), allocatable :: words

    words = "("//to_text(counts(1))//", "//to_text(counts(2))//", "//to_text(counts(3))//")"
  end function triple

  !> The control point that moves fastest, with its place: where an unstable run shows first.
  function fastest_place(blank) result(words)
    type(blank_t), intent(in) :: blank
    character(:), allocatable :: words
    real(wp) :: largest, speed
    integer :: p, i, j, k, part, at(3)

    largest = -1.0_wp
    part = 1
    at = 1
    do p = 1, size(blank%parts)
      associate (v => blank%parts(p)%motion%v)
        do k = 1, size(v, 3)
          do j = 1, size(v, 2)
            do i = 1, size(v, 1)
              speed = maxval(abs(v(i, j, k, :)))
              if (.not. speed > largest) cycle
              largest = speed
              part = p
              at = [i, j, k]
            end do
          end do
        end do
      end associate
    end do
    words = ""
    if (size(blank%parts) > 1) words = "patch '"//blank%parts(part)%name//"', "
    associate (body => blank%parts(part))
      words = words//"control point "//triple(at)//", by element "// &
              triple([(element_of(at(i), i), i=1, 3)])//", at "// &
              place_text(body%motion%x(at(1), at(2), at(3), :))
    end associate

  contains

    !> The middle one of the elements that a control point reaches into.
    integer function element_of(control, axis) result(element)
      integer, intent(in) :: control, axis

      associate (table => blank%parts(part)%patch%axes(axis))
        element = (count(table%first < control - table%degree) + 1 &
                   + count(table%first <= control))/2
      end associate
    end function element_of
  end function fastest_place

  !> Where a contact is deepest. Its forces do not tell: a spring may be loaded from a depth on, and
  !! friction adds to it.
  function deepest_place(contact, tool) result(words)
    type(contact_t), intent(in) :: contact
    type(tool_t), intent(in) :: tool
    character(:), allocatable :: words
    real(wp) :: depths(contact%slave%n_points)
    integer :: n

    depths = 0.0_wp
    do n = 1, contact%slave%n_points
      if (contact%start(n) < 0.0_wp) cycle   ! it does not touch
      depths(n) = norm2(place_now(contact, n) - contact%motion%displacement &
                        - face_position(tool%orders, tool%coefficients(:, :, :, contact%face(n)), &
                                        contact%at(n, :)))
    end do
    words = contact_place(contact, tool, maxloc(depths, 1))
  end function deepest_place

  !> Place of a slave point at the last call, for a tool that turns in its frame.
  pure function place_now(contact, n) result(x)
    type(contact_t), intent(in) :: contact
    integer, intent(in) :: n                !! number of the point
    real(wp) :: x(3)
    integer :: i, j

    j = (n - 1)/contact%slave%n_along(1) + 1
    i = n - contact%slave%n_along(1)*(j - 1)
    x = point_position(contact%slave, contact%motion%now, i, j)
  end function place_now

  !> A slave point and where it is. The contact of a tool that turns keeps places in its frame.
  function contact_place(contact, tool, n) result(words)
    type(contact_t), intent(in) :: contact
    type(tool_t), intent(in) :: tool
    integer, intent(in) :: n                !! number of the point
    character(:), allocatable :: words
    real(wp) :: x(3)
    integer :: i, j

    j = (n - 1)/contact%slave%n_along(1) + 1
    i = n - contact%slave%n_along(1)*(j - 1)
    x = place_now(contact, n)
    if (tool%is_turning) x = matmul(tool%rotation, x - tool%displacement) + tool%displacement
    words = "contact point ("//to_text(i)//", "//to_text(j)//"), at "//place_text(x)
  end function contact_place

end module trouble_spot
