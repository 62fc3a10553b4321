!> How a place of a face of the blank lies to a tool: what the search for the deepest one asks.
module penetration_sample
  use kinds, only: wp
  use tool, only: tool_t
  use closest_point, only: hit_t, follow, is_beside
  use closest_point_lanes, only: lanes_t, follow_lanes, n_lanes
  use tool_search, only: search_tool, search_all_faces
  use cell_tree, only: distance_to_leaves
  implicit none
  private

  public :: deep_place_t, sample_t, follow_samples, make_sure, look, note, keep
  public :: width_of, hides_depth

  real(wp), parameter :: bent = 0.9_wp           !! cosine between normals at the ends of a cell

  !> Depth of a place far from the tool or beside it [length].
  real(wp), parameter, public :: nowhere = -huge(1.0_wp)

  !> The deepest place of a face.
  type :: deep_place_t
    real(wp) :: depth = 0.0_wp         !! 0: no place of the face is in the tool [length]
    real(wp) :: at(2) = 0.0_wp         !! parametric coordinates of the face
    real(wp) :: x(3) = 0.0_wp          !! where it is [length]
    real(wp) :: step(2) = 0.0_wp       !! parametric distance to the next samples
    real(wp) :: width = 0.0_wp         !! the same, amply [length]
    integer :: face = 0                !! of the tool where it is nearest
    real(wp) :: on(2) = 0.0_wp         !! local coordinates there
    logical :: is_sure = .false.       !! of all places of the tool none is nearer
    logical :: is_smooth = .false.     !! the tool around it
  end type deep_place_t

  !> What a sample has found.
  type :: sample_t
    real(wp) :: x(3) = 0.0_wp          !! in the tool's frame [length]
    real(wp) :: depth = nowhere        !! below 0: so far outside [length]
    real(wp) :: clear = 0.0_wp         !! how far it may move before it can be in the tool
    real(wp) :: normal(3) = 0.0_wp, foot(3) = 0.0_wp   !! of the tool where it is nearest
    integer :: face = 0                !! there, and local coordinates
    real(wp) :: on(2) = 0.0_wp
    logical :: is_seen = .false., is_beside = .false.
    logical :: is_sure = .false.       !! of all places of the tool none is nearer
  end type sample_t

contains

  !> Follow up to eight samples; those that do not settle are searched.
  pure subroutine follow_samples(tool, overhang, low, high, at, n, lanes, found)
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: overhang
    integer, intent(in) :: low(2), high(2), at(2, n_lanes)
    integer, intent(inout) :: n                  !! how many; then 0
    type(lanes_t), intent(inout) :: lanes
    type(sample_t), intent(inout) :: found(low(1):high(1), low(2):high(2))
    type(hit_t) :: hit
    real(wp) :: start(2, n_lanes)
    integer :: k, face(n_lanes)

    face = lanes%face
    start(1, :) = lanes%s
    start(2, :) = lanes%t
    do k = n + 1, n_lanes
      lanes%face(k) = lanes%face(n)
      lanes%x(k, :) = lanes%x(n, :)
      lanes%s(k) = lanes%s(n)
      lanes%t(k) = lanes%t(n)
    end do
    call follow_lanes(tool, lanes)
    do k = 1, n
      associate (sample => found(at(1, k), at(2, k)))
        if (.not. lanes%is_good(k)) then
          call follow(tool, sample%x, face(k), start(:, k), hit)
          if (hit%is_converged) then
            call note(tool, overhang, hit, sample)
          else
            call look(tool, overhang, sample)
          end if
          cycle
        end if
        sample%is_seen = .true.
        sample%normal = lanes%normal(k, :)
        sample%foot = sample%x - lanes%gap(k)*sample%normal
        sample%depth = -lanes%gap(k)
        sample%face = face(k)
        sample%on = [lanes%s(k), lanes%t(k)]
        sample%clear = max(lanes%gap(k), 0.0_wp)
      end associate
    end do
    n = 0
  end subroutine follow_samples

  !> Search the whole tool for what is nearest to a place.
  pure subroutine make_sure(tool, shift, overhang, place)
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: shift(3), overhang
    type(deep_place_t), intent(inout) :: place
    type(sample_t) :: sample

    sample%x = place%x - shift
    call look(tool, overhang, sample)
    place%depth = sample%depth
    place%face = sample%face
    place%on = sample%on
    place%is_sure = .true.
  end subroutine make_sure

  !> How a point lies to the tool.
  pure subroutine look(tool, overhang, sample)
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: overhang
    type(sample_t), intent(inout) :: sample
    type(hit_t) :: hit

    sample%depth = nowhere
    sample%clear = 0.0_wp
    sample%is_seen = .false.
    sample%is_sure = .true.
    associate (x => sample%x)
      call search_tool(tool, x, 0.0_wp, .false., hit)
      if (hit%face == 0) then
        if (.not. all(x >= tool%box(:, 1) .and. x <= tool%box(:, 2))) then
          if (hit%is_converged) sample%clear = max(distance_to_leaves(tool%tree, x), &
                                                   tool%search_distance)
          return
        end if
        call search_all_faces(tool, x, hit)
        if (hit%face == 0) return
      end if
    end associate
    call note(tool, overhang, hit, sample)
  end subroutine look

  !> Keep what a search has found.
  pure subroutine note(tool, overhang, hit, sample)
    type(tool_t), intent(in) :: tool
    real(wp), intent(in) :: overhang
    type(hit_t), intent(in) :: hit
    type(sample_t), intent(inout) :: sample

    sample%is_seen = .true.
    sample%is_beside = is_beside(tool, hit, overhang)
    sample%face = hit%face
    sample%on = hit%at
    sample%normal = hit%normal
    sample%foot = sample%x - hit%gap*hit%normal
    if (hit%gap >= 0.0_wp) then
      sample%clear = hit%distance
    else if (sample%is_beside) then
      sample%clear = hit%overhang - overhang
    end if
    sample%depth = merge(nowhere, -hit%gap, sample%is_beside)
  end subroutine note

  !> Keep the deeper of two places.
  pure subroutine keep(sample, at, shift, step, best)
    type(sample_t), intent(in) :: sample
    real(wp), intent(in) :: at(2), shift(3), step(2)
    type(deep_place_t), intent(inout) :: best

    if (.not. sample%depth > best%depth) return
    best%depth = sample%depth
    best%at = at
    best%x = sample%x + shift
    best%step = step
    best%face = sample%face
    best%on = sample%on
    best%is_sure = sample%is_sure
  end subroutine keep

  !> Length of the diagonals of a cell.
  pure real(wp) function width_of(corners) result(width)
    type(sample_t), intent(in) :: corners(2, 2)

    width = max(norm2(corners(1, 1)%x - corners(2, 2)%x), norm2(corners(1, 2)%x - corners(2, 1)%x))
  end function width_of

  !> May a cell hold a place deeper than `known`, which no climb from its corners finds? Where the
  !! tool ends in it, and where between two corners it turns by an angle a towards the sheet at
  !! once: then it rises by less than a/2 of their distance.
  pure logical function hides_depth(corners, is_smooth, known) result(is_hidden)
    type(sample_t), intent(in) :: corners(2, 2)
    logical, intent(in) :: is_smooth        !! the tool around it
    real(wp), intent(in) :: known           !! [length]
    integer, parameter :: ends(4, 6) = reshape([1, 1, 2, 1, 1, 2, 2, 2, 1, 1, 1, 2, &
                                                2, 1, 2, 2, 1, 1, 2, 2, 2, 1, 1, 2], [4, 6])
    real(wp) :: deepest, cosine
    integer :: k

    is_hidden = any(corners%is_beside) .and. minval(corners%clear) < 0.5_wp*width_of(corners)
    deepest = maxval(corners%depth)
    if (is_smooth .or. .not. deepest > nowhere) return
    do k = 1, 6
      if (is_hidden) return
      associate (a => corners(ends(1, k), ends(2, k)), b => corners(ends(3, k), ends(4, k)))
        if (.not. (a%is_seen .and. b%is_seen)) cycle
        cosine = sum(a%normal*b%normal)
        if (cosine > bent .or. sum((a%normal - b%normal)*(a%foot - b%foot)) <= 0.0_wp) cycle
        is_hidden = deepest + 0.5_wp*acos(max(cosine, -1.0_wp))*norm2(a%x - b%x) > known
      end associate
    end do
  end function hides_depth

end module penetration_sample
