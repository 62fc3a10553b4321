!> Calls of a user's USDFLD or VUSDFLD, which set field variables before the stress of an increment,
!! and of a UVARM, which sets output variables after it.
module user_fields
  use, intrinsic :: ieee_arithmetic, only: ieee_is_finite
  use, intrinsic :: iso_c_binding, only: c_char, c_int, c_size_t
  use kinds, only: wp
  use text, only: to_text
  use point_context, only: point_context_t, number_in_plane, number_through
  use user_call, only: user_law_t, name_length, slack, n_guard, n_room, set_guard, check_guard, &
                       check_spare_states, enter_user_call, leave_user_call, offer_values, &
                       end_user_run, in_usdfld, in_vusdfld, in_uvarm
  use user_kinematics, only: identity
  implicit none
  private

  public :: define_fields, define_block_fields, update_output

  !> JMAC and JMATYP, which a source passes on to GETVRM, and the name of no *ORIENTATION.
  integer(c_int), parameter :: nothing(15) = 0_c_int
  character(kind=c_char), parameter :: no_name(name_length) = " "

  !> The places of the entries 11, 21, 31, 12, ... in a matrix row by row.
  integer, parameter :: columns(9) = [1, 4, 7, 2, 5, 8, 3, 6, 9]

  !> What of the deck gives the number of field variables.
  character(*), parameter :: givers_of_fields = &
    "field variables (those of *INITIAL CONDITIONS, TYPE=FIELD and *FIELD, at least one)"

contains

  !> Field variables of point `l` of a call by the user's USDFLD. Those at the end of an increment
  !! are those at the start of the next.
  subroutine define_fields(law, context, l, dt, stress, state, fields, changes)
    class(user_law_t), intent(in) :: law
    type(point_context_t), intent(in) :: context
    integer, intent(in) :: l
    real(wp), intent(in) :: dt, stress(6)
    real(wp), intent(inout) :: state(law%n_state)      !! its state variables and last fields
    !> At the start and their change: on entry as the deck has them, then as the user.
    real(wp), intent(inout) :: fields(:), changes(:)
    real(wp) :: field(law%n_own_fields + slack + n_guard + n_room), pnewdt
    real(wp) :: statev(law%n_statv + slack + n_guard + n_room)
    real(wp), target :: offered(6 + law%n_statv)

    associate (n => law%n_own_fields, m => law%n_statv)
      field(:n) = fields(:n) + changes(:n)
      call set_guard(field, n, slack)
      statev(:m) = state(:m)
      call set_guard(statev, m, slack)
      offered = [stress, state(:m)]
      pnewdt = 1.0_wp
      call enter(law, in_usdfld, context, l, l, offered)
      call law%usdfld(field, statev, pnewdt, identity, identity, context%length(l), &
                      [context%step_time, context%time], dt, law%name, no_name, int(n, c_int), &
                      int(m, c_int), int(context%element(l), c_int), &
                      int(number_in_plane(context, l), c_int), 1_c_int, &
                      int(number_through(context, l), c_int), &
                      [int(context%step, c_int), 0_c_int, 0_c_int, 0_c_int], &
                      int(context%increment, c_int), int(law%n_direct, c_int), &
                      int(law%n_shear, c_int), context%place(l, :), &
                      nothing, nothing, 1_c_int, 0_c_int, int(name_length, c_size_t), &
                      int(name_length, c_size_t))
      call check_guard(statev, m, slack, "STATEV")
      call check_spare_states(statev(m + 1), 1, slack, m, "STATEV(")
      call check_values(field, n, "FIELD(", givers_of_fields)
      if (.not. pnewdt >= 1.0_wp) &
        call end_user_run("asks for a smaller increment by PNEWDT, which only a UMAT may do")
      call leave(offered)
      if (.not. is_first(context)) fields(:n) = state(law%n_before - n + 1:law%n_before)
      changes(:n) = field(:n) - fields(:n)
      state(:m) = statev(:m)
      state(law%n_before - n + 1:law%n_before) = field(:n)
    end associate
  end subroutine define_fields

  !> The same by a VUSDFLD for a block: one integration point of different elements. Its stateNew
  !! is the stateOld of the VUMAT.
  subroutine define_block_fields(law, context, lanes, dt, rotation, stress, own, fields)
    class(user_law_t), intent(in) :: law
    type(point_context_t), intent(in) :: context
    integer, intent(in) :: lanes(:)
    real(wp), intent(in) :: dt
    real(wp), intent(in) :: rotation(size(lanes), 9)    !! of the frame, row by row
    real(wp), intent(in) :: stress(size(lanes), 6)      !! in the order of a VUMAT
    real(wp), intent(inout) :: own(size(lanes), law%n_state)
    !> At the start, then at the end: on entry as the deck has them, then as the user.
    real(wp), intent(inout) :: fields(size(lanes), 2*law%n_own_fields)
    real(wp) :: field(law%n_own_fields*size(lanes) + slack*size(lanes) + n_guard + n_room)
    real(wp) :: new((law%n_statv + slack)*size(lanes) + n_guard + n_room)
    real(wp) :: old(size(lanes), law%n_statv + slack)
    real(wp), target :: offered(size(lanes)*(6 + law%n_statv))
    real(wp) :: t(size(lanes), 9), place(size(lanes), 3), lengths(size(lanes))
    associate (b => size(lanes), n => law%n_own_fields, m => law%n_statv)
      old(:, :m) = own(:, :m)
      old(:, m + 1:) = 0.0_wp
      new(:m*b) = reshape(own(:, :m), [m*b])
      call set_guard(new, m*b, slack*b)
      field(:n*b) = reshape(fields(:, n + 1:), [n*b])
      call set_guard(field, n*b, slack*b)
      offered = [stress, own(:, :m)]
      t = spread(reshape(identity, [9]), 1, b)
      place = context%place(lanes, :)
      lengths = context%length(lanes)
      call enter(law, in_vusdfld, context, lanes(1), lanes(b), offered)
      call law%vusdfld(int(b, c_int), int(m, c_int), int(n, c_int), int(law%n_props, c_int), &
                       int(law%n_direct, c_int), int(law%n_shear, c_int), &
                       int(context%element(lanes), c_int), &
                       int(number_in_plane(context, lanes(1)), c_int), 1_c_int, &
                       int(number_through(context, lanes(1)), c_int), &
                       context%step_time + dt, context%time + dt, dt, law%name, place, &
                       rotation(:, columns), t, lengths, law%props, &
                       old, new, field, int(name_length, c_size_t))
      call check_guard(new, m*b, slack*b, "stateNew")
      call check_spare_states(new(m*b + 1), b, slack, m, "stateNew(:,")
      call check_block(field, b, n)
      call leave(offered)
      if (.not. is_first(context)) fields(:, :n) = own(:, law%n_before - n + 1:law%n_before)
      fields(:, n + 1:) = reshape(field(:n*b), [b, n])
      own(:, :m) = reshape(new(:m*b), [b, m])
      own(:, law%n_before - n + 1:law%n_before) = fields(:, n + 1:)
    end associate
  end subroutine define_block_fields

  !> Output variables of point `l` of a call by the user's UVARM, after the stress.
  subroutine update_output(law, context, l, dt, stress, state)
    class(user_law_t), intent(in) :: law
    type(point_context_t), intent(in) :: context
    integer, intent(in) :: l
    real(wp), intent(in) :: dt, stress(6)
    real(wp), intent(inout) :: state(law%n_state)
    real(wp) :: uvar(law%n_uvarm + slack + n_guard + n_room)
    real(wp), target :: offered(6 + law%n_statv)

    associate (n => law%n_uvarm, m => law%n_statv)
      uvar(:n) = state(m + 1:m + n)
      call set_guard(uvar, n, slack)
      offered = [stress, state(:m)]
      call enter(law, in_uvarm, context, l, l, offered)
      call law%uvarm(uvar, identity, identity, [context%step_time, context%time] + dt, dt, &
                     law%name, no_name, int(n, c_int), int(context%element(l), c_int), &
                     int(number_in_plane(context, l), c_int), 1_c_int, &
                     int(number_through(context, l), c_int), &
                     [int(context%step, c_int), 0_c_int, 0_c_int, 0_c_int], &
                     int(context%increment, c_int), int(law%n_direct, c_int), &
                      int(law%n_shear, c_int), context%place(l, :), &
                     nothing, nothing, 1_c_int, 0_c_int, int(name_length, c_size_t), &
                     int(name_length, c_size_t))
      call check_values(uvar, n, "UVAR(", "*USER OUTPUT VARIABLES")
      call leave(offered)
      state(m + 1:m + n) = uvar(:n)
    end associate
  end subroutine update_output

  !> A call begins for the points of these lanes, which may ask for stress and state variables.
  subroutine enter(law, routine, context, first, last, offered)
    class(user_law_t), intent(in) :: law
    integer(c_int), intent(in) :: routine
    type(point_context_t), intent(in) :: context
    integer, intent(in) :: first, last
    real(wp), intent(in), target, contiguous :: offered(:)   ! its address is kept

    call offer_values(offered, int(size(offered)/(6 + law%n_statv), c_int), int(law%n_statv, c_int))
    call enter_user_call(routine, int(context%element(first), c_int), &
                         int(context%point(first), c_int), int(context%element(last), c_int))
  end subroutine enter

  !> The call is over, and what it could ask for is gone.
  subroutine leave(offered)
    real(wp), intent(in), target, contiguous :: offered(:)

    call leave_user_call()
    call offer_values(offered, 0_c_int, 0_c_int)
  end subroutine leave

  !> Is it the first increment of the run, before which no fields of the user are known?
  pure logical function is_first(context)
    type(point_context_t), intent(in) :: context

    is_first = context%step == 1 .and. context%increment == 1
  end function is_first

  !> End the run if one of the values is NaN or infinite, or if more of them were written.
  subroutine check_values(values, n, name, giver)
    real(wp), intent(in) :: values(:)
    integer, intent(in) :: n
    character(*), intent(in) :: name    !! of the argument, with the bracket
    character(*), intent(in) :: giver   !! what of the deck gives their number
    integer :: i

    call check_guard(values, n, slack, name(:len(name) - 1))
    i = findloc(abs(values(n + 1:n + slack)) <= 0.0_wp, .false., 1, back=.true.)
    if (i > 0) call end_user_run("writes "//name//to_text(n + i)//"), but the deck gives "// &
                                 to_text(n)//": "//giver)
    i = findloc(ieee_is_finite(values(:n)), .false., 1)
    if (i > 0) call end_user_run("returns no finite number (NaN or infinity) as "//name// &
                                 to_text(i)//")")
  end subroutine check_values

  !> The same for the field variables of a block.
  subroutine check_block(field, n_points, n)
    real(wp), intent(in) :: field(:)
    integer, intent(in) :: n_points, n
    real(wp) :: one(n + slack + n_guard)
    integer :: i

    call check_guard(field, n*n_points, slack*n_points, "field")
    do i = 1, n_points
      call set_guard(one, n, slack)
      one(:n + slack) = field(i:n_points*(n + slack):n_points)
      call check_values(one, n, "field(:,", givers_of_fields)
    end do
  end subroutine check_block

end module user_fields
